#include "server/datasets/mounts.h"

#include <ctime>
#include <filesystem>

#include "pipeline/store/sqlite.h"
#include "pipeline/store/store_object.h"
#include "pipeline/tileset/manifest_json.h"
#include "raster/storage/storage.h"
#include "server/data/layout.h"
#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

using Clock = std::chrono::steady_clock;
using OpenedTerrain = proto::Result<std::shared_ptr<const pipeline::faces::Terrain>>;

constexpr auto kLook = std::chrono::seconds(5);   // a request to the storage; how late a new version may be seen
constexpr auto kPause = std::chrono::seconds(5);  // after a failure, so that waiting for a dead storage does not take all threads

std::string start_text() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

/// What clients are told: where it lies is nobody else's business.
proto::Problem unreachable(const std::string& name, const proto::Problem& why) {
  const bool storage = why.type == "storage-read" || why.type == "storage-changed";
  return {"storage-unreachable",
          "dataset " + name +
              (storage ? " lies in a storage that does not give it at the moment"
                       : " cannot be read where it lies: it is no finished dataset of this version"),
          "asking again later", ""};
}

namespace fs = std::filesystem;

/// A dataset's folder of a server holds the file.
std::string file_in(const std::string& path) {
  std::error_code error;
  const fs::path file = fs::path(path) / kStoreFile;
  return fs::is_directory(path, error) && fs::exists(file, error) ? file.string() : path;
}

}  // namespace

std::optional<proto::Problem> refuse_mounts(const std::vector<Mount>& mounts) {
  for (const Mount& mount : mounts) {
    if (raster::is_remote(mount.path)) continue;
    const auto refused = [&](const std::string& why) {
      return proto::Problem{"mount-unusable", "dataset " + mount.name + ": " + why,
                            "a finished .sqlite file, or a folder that `cordillera build -o` wrote", "--mount"};
    };
    std::error_code error;
    const std::string file = file_in(mount.path);
    if (!fs::exists(file, error)) return refused("there is no " + mount.path);
    if (fs::is_directory(file, error)) {
      if (!pipeline::manifest_of_folder(file))
        return refused("the folder " + mount.path + " holds neither manifest.json nor " + kStoreFile);
      continue;
    }
    const auto manifest = pipeline::StoreReader::manifest_of(file);
    if (!manifest) return refused(manifest.problem().detail);
  }
  return std::nullopt;
}

Mounts::Mounts(const Settings& settings)
    : cache_(std::make_shared<raster::BlockCache>(std::uint64_t{settings.serve.cache_mib} << 20)) {
  for (const Mount& mount : settings.serve.mounts) {
    auto place = std::make_unique<Place>();
    std::error_code error;
    place->path = raster::is_remote(mount.path) ? mount.path : file_in(mount.path);
    place->is_folder = !raster::is_remote(mount.path) && fs::is_directory(place->path, error);
    Dataset dataset;
    dataset.id = dataset.name = mount.name;
    dataset.state = State::ready;
    dataset.created = start_text();
    dataset.is_private = settings.private_dataset;
    dataset.mounted = true;
    place->row = std::make_shared<const Dataset>(std::move(dataset));
    places_[mount.name] = std::move(place);
  }
}

Row Mounts::find(const std::string& name) const {
  const auto found = places_.find(name);
  return found == places_.end() ? nullptr : found->second->row;
}

std::string Mounts::folder(const std::string& name) const {
  const auto found = places_.find(name);
  return found != places_.end() && found->second->is_folder ? found->second->path : "";
}

proto::Result<proto::Manifest> Mounts::manifest(const std::string& name) {
  const std::string there = folder(name);
  if (there.empty()) {
    const auto terrain = open(name);
    return terrain ? proto::Result<proto::Manifest>((*terrain)->manifest()) : terrain.problem();
  }
  auto manifest = pipeline::manifest_of_folder(there);
  return manifest ? std::move(manifest) : unreachable(name, {});
}

std::vector<Row> Mounts::list() const {
  std::vector<Row> all;
  for (const auto& [name, place] : places_) all.push_back(place->row);
  return all;
}

/// Outside of the lock but for the taking: one request pays for the question, the others go on with what is open.
void Mounts::look_again(const std::string& name, Place& place) {
  std::shared_ptr<raster::ObjectFile> file;
  {
    const std::lock_guard lock(place.mutex);
    if (!place.file || Clock::now() - place.looked < kLook) return;
    place.looked = Clock::now();
    file = place.file;
  }
  const auto same = file->unchanged();
  if (!same.ok()) {
    log_warning("dataset " + name + ": " + same.problem().detail + "; what is in the cache is still served");
    return;
  }
  if (*same) return;
  const std::lock_guard lock(place.mutex);
  if (place.file != file) return;
  log_info("dataset " + name + ": another one has been published in its place");
  place.file.reset();
  place.terrain.reset();
}

OpenedTerrain Mounts::open(const std::string& name) {
  Place& place = *places_.at(name);
  if (place.is_folder) {
    return proto::Problem{"not-in-folder", "dataset " + name + " is a folder of finished tiles, and this is not among them",
                          "manifest.json and the formats that the folder was built with; everything of a dataset that was built "
                          "with `cordillera build -o NAME.sqlite`",
                          ""};
  }
  look_again(name, place);
  const std::lock_guard lock(place.mutex);
  if (place.terrain) return place.terrain;
  if (place.problem && Clock::now() - place.tried < kPause) return *place.problem;
  const auto failed = [&](const proto::Problem& why) -> OpenedTerrain {
    log_warning("dataset " + name + ": " + why.detail);
    place.problem = unreachable(name, why);
    place.tried = Clock::now();
    return *place.problem;
  };
  auto file = raster::ObjectFile::open(place.path, cache_);
  if (!file) return failed(file.problem());
  auto reader = pipeline::open_store(*file);
  if (!reader) return failed(reader.problem());
  place.problem.reset();
  place.file = *file;
  place.looked = Clock::now();
  place.terrain = std::make_shared<const pipeline::faces::Terrain>(std::move(reader).value());
  return place.terrain;
}

std::optional<proto::Problem> Mounts::after_failure(const std::string& name) {
  Place& place = *places_.at(name);
  const std::lock_guard lock(place.mutex);
  const auto trouble = place.file ? place.file->trouble() : std::nullopt;
  if (!trouble) return std::nullopt;  // another thread has seen it before, or what was read is damaged
  if (trouble->type == "storage-changed") {
    place.file.reset();
    place.terrain.reset();
    return std::nullopt;
  }
  log_warning("dataset " + name + ": " + trouble->detail);
  return unreachable(name, *trouble);
}

Response of_mount(Mounts& mounts, const std::string& name, const std::function<Response()>& read) {
  for (bool again = false;; again = true) {
    try {
      return read();
    } catch (const pipeline::StoreError&) {
      const auto problem = mounts.after_failure(name);
      if (!problem && again) throw;
      if (problem) return problem_response(*problem);
    }
  }
}

}  // namespace cordillera::server
