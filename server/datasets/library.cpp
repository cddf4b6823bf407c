#include "server/datasets/library.h"

#include <algorithm>

#include "server/http/digest.h"
#include "server/log/log.h"

namespace cordillera::server {

namespace {

constexpr std::uint64_t kLookEvery = 32;  // requests

std::shared_ptr<const Summary> summary_of(const proto::Manifest& manifest) {
  auto summary = std::make_shared<Summary>(Summary{manifest, version_of(manifest)});
  for (auto clear : {&proto::Manifest::clear_levels, &proto::Manifest::clear_sources, &proto::Manifest::clear_source,
                     &proto::Manifest::clear_options}) {
    (summary->manifest.*clear)();
  }
  if (!manifest.options().imagery().empty()) summary->manifest.mutable_options()->set_imagery(manifest.options().imagery());
  return summary;
}

/// Of what is shown before a build is done. No id has a slash.
std::string unfinished_key(const std::string& id, const std::string& store) { return id + "/" + store; }

}  // namespace

std::string version_of(const proto::Manifest& manifest) {
  return digest(manifest.SerializeAsString() + CORDILLERA_VERSION).substr(0, 16);
}

proto::Problem Library::unreadable(const std::string& id, const proto::Problem& why) {
  return why.type == "service-busy" ? wants_descriptor(id) : damaged(id, why.detail);
}

proto::Problem wants_descriptor(const std::string& id) {
  return {"service-busy", "the service has too many files open to read dataset " + id, "asking again later", ""};
}

proto::Problem unknown_dataset(const std::string& id) {
  return {"dataset-unknown", "there is no dataset '" + id + "'", "an id that GET /v1/datasets lists", ""};
}

proto::Problem Library::damaged(const std::string& id, const std::string& why) {
  if (is_there_ && !is_there_(id)) return unknown_dataset(id);
  log_warning("dataset " + id + ": " + why);  // with its place on this machine, which is nobody else's business
  metrics_.store_damaged.add(1);
  const std::lock_guard lock(mutex_);
  damaged_.insert(id);
  return {"store-damaged", "what was built of dataset " + id + " is damaged or can no longer be read",
          "posting the raster again, or a backup", ""};
}

std::size_t Library::damaged_count() {
  const std::lock_guard lock(mutex_);
  return damaged_.size();
}

std::shared_ptr<const pipeline::faces::Terrain> Library::find(const std::string& key) {
  const auto found = std::find_if(open_.begin(), open_.end(), [&](const auto& entry) { return entry.first == key; });
  if (found == open_.end()) return nullptr;
  open_.splice(open_.begin(), open_, found);
  return open_.front().second;
}

/// Takes out those that were used longest ago, until the rest is not too much.
Library::Open Library::too_much() {
  Open closed;
  std::size_t kept = 0;
  for (auto at = open_.begin(); at != open_.end(); ++at) {
    kept += at->second->kept_bytes();
    if (at == open_.begin() || kept <= bounds_.kept_bytes) continue;
    closed.splice(closed.end(), open_, at, open_.end());
    break;
  }
  if (open_.size() > bounds_.open) closed.splice(closed.end(), open_, std::prev(open_.end()));
  return closed;
}

proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> Library::open(const std::string& id) {
  if (mounts_.has(id)) return mounts_.open(id);
  auto terrain = open_file(id, layout_.store(id), id);
  if (!terrain) return unreadable(id, terrain.problem());
  return terrain;
}

std::shared_ptr<const pipeline::faces::Terrain> Library::provisional(const std::string& id) {
  return unfinished(id, layout_.provisional(id));
}

std::shared_ptr<const pipeline::faces::Terrain> Library::finest(const std::string& id, const proto::TileAddress& block) {
  return unfinished(id, layout_.finest(id, block));
}

std::shared_ptr<const pipeline::faces::Terrain> Library::unfinished(const std::string& id, const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return nullptr;
  auto terrain = open_file(unfinished_key(id, file.filename().string()), file, id);
  return terrain ? *terrain : nullptr;
}

proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> Library::open_file(const std::string& key,
                                                                                  const std::filesystem::path& file,
                                                                                  const std::string& id) {
  std::uint64_t before = 0;
  Open closed;  // stands before the lock: what is freed is freed without it
  {
    const std::lock_guard lock(mutex_);
    before = forgotten_;
    auto terrain = find(key);
    if (++asked_ % kLookEvery == 0) closed = too_much();
    metrics_.store_opens.add(1, {terrain ? "hit" : "miss"});
    if (terrain) return terrain;
  }
  // Without the lock: who reads another dataset does not wait for this one's disk.
  auto reader = pipeline::open_store_with(file.string(), words(id));
  if (!reader) return reader.problem();
  auto terrain = std::make_shared<const pipeline::faces::Terrain>(std::move(reader).value());
  const std::lock_guard lock(mutex_);
  if (forgotten_ != before) return terrain;
  if (auto other = find(key)) return other;  // opened by another thread meanwhile
  open_.emplace_front(key, terrain);
  closed.splice(closed.end(), too_much());
  return terrain;
}

proto::Result<std::shared_ptr<const Summary>> Library::summary(const std::string& id) {
  if (mounts_.has(id)) {
    const auto manifest = mounts_.manifest(id);
    if (!manifest) return manifest.problem();
    return summary_of(*manifest);
  }
  std::uint64_t before = 0;
  {
    const std::lock_guard lock(mutex_);
    before = forgotten_;
    if (const auto known = summaries_.find(id); known != summaries_.end()) return known->second;
  }
  auto manifest = pipeline::StoreReader::manifest_of(layout_.store(id).string());
  if (!manifest) return unreadable(id, manifest.problem());
  pipeline::put_words(words(id), *manifest);
  auto summary = summary_of(*manifest);
  const std::lock_guard lock(mutex_);
  if (forgotten_ == before) summaries_.insert_or_assign(id, summary);
  return summary;
}

void Library::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  ++forgotten_;
  summaries_.erase(id);
  damaged_.erase(id);
  open_.remove_if([&, unfinished = unfinished_key(id, "")](const auto& entry) {
    return entry.first == id || entry.first.starts_with(unfinished);
  });
}

}  // namespace cordillera::server
