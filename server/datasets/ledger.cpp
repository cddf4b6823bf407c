#include "server/datasets/ledger.h"

#include <algorithm>
#include <set>

#include "pipeline/store/sqlite.h"
#include "proto/files.h"
#include "proto/numbers.h"
#include "raster/storage/storage.h"
#include "server/datasets/dataset_folder.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/log/log.h"

namespace cordillera::server::updates {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

constexpr int kMostEnded = 50;  // changes whose end is remembered, and rollbacks

Problem damaged(const fs::path& file, const std::string& why) {
  return {"store-damaged", file.filename().string() + " " + why, "a backup", ""};
}

// The last member of the list: the SHA-256 of all before it.
constexpr std::string_view kSum = ",\"sum\":\"", kEnd = "\"}\n";

std::string with_sum(std::string json) {
  json.pop_back();  // its last brace
  const std::string sum = digest(json);
  return json.append(kSum).append(sum).append(kEnd);
}

/// A list without a sum was written before there were sums. False: damaged.
bool read_list(const std::string& text, proto::SourceChanges* changes) {
  const std::size_t end = text.rfind(kSum);
  if (end == text.npos) return from_json(text, changes, Unknown::refused);
  const std::string json = text.substr(0, end) + "}";
  return text == with_sum(json) && from_json(json, changes);
}

/// Where it is not there and nothing says that it was, an empty one: the dataset may have been deleted meanwhile.
proto::Result<proto::SourceChanges> read_file(const fs::path& folder) {
  proto::SourceChanges changes;
  if (!is_changeable(folder)) return changes;
  const fs::path place = folder / kChangesFile;
  const auto text = proto::bytes_of_file(place);
  if (!text || !read_list(*text, &changes)) return damaged(place, "is missing or cannot be read");
  const auto stays = [](const auto& source) { return may_be_raster(source.spec().path()); };
  const bool all_stay = std::ranges::all_of(
      changes.pending(), [&](const auto& change) { return stays(change.source()) && std::ranges::all_of(change.more(), stays); });
  if (!all_stay) return damaged(place, "names a raster outside its folder");
  return changes;
}

template <class T>
T value_of(proto::Result<T> read) {
  if (!read) throw pipeline::StoreError(read.problem().detail);
  return std::move(read).value();
}

/// The version that is served. A change that came to its end has left one, for nothing comes behind a first change that fails.
proto::Result<std::optional<proto::DatasetVersion>> served_in(const fs::path& folder, const proto::SourceChanges& changes) {
  auto version = version_in(folder / kStoreFile);
  if (version && !*version && changes.ended_size() > 0) return damaged(folder / kStoreFile, "is missing");
  return version;
}

/// Whether a file is part of what is shown of a first version while that is made, or says where people look. What is still being
/// written is not.
bool is_shown(const std::string& name) {
  return name == kProvisionalStore || name == kLookedAtFile || name == kAllWantedFile ||
         (is_finest_store(name) && name.find(kBeingWritten) == name.npos);
}

proto::Result<void> write_file(const fs::path& folder, const proto::SourceChanges& changes) {
  const auto written = raster::write_whole((folder / kChangesFile).string(), with_sum(to_json_line(changes)));
  if (written.ok()) return {};
  return Problem{"storage-full", "the change cannot be written down: the disk is full or fails",
                 "trying again when there is room", ""};
}

/// One of those that wait has come to its end.
void end_pending(proto::SourceChanges& changes, int which, const std::optional<Problem>& problem) {
  proto::SourceChange& ended = *changes.add_ended();
  ended = changes.pending(which);
  if (problem) *ended.mutable_problem() = to_error(*problem);
  changes.mutable_pending()->DeleteSubrange(which, 1);
  if (changes.ended_size() > kMostEnded) changes.mutable_ended()->DeleteSubrange(0, changes.ended_size() - kMostEnded);
}

Problem unknown(const std::string& source) {
  return {"source-unknown", "the dataset has no raster '" + source + "'", "an id that GET …/sources lists", ""};
}

auto place_of(std::vector<proto::DatasetSource>& sources, const std::string& id) {
  return std::find_if(sources.begin(), sources.end(), [&](const proto::DatasetSource& source) { return source.id() == id; });
}

void insert(std::vector<proto::DatasetSource>& sources, std::size_t position, const proto::DatasetSource& source) {
  sources.insert(sources.begin() + static_cast<std::ptrdiff_t>(std::min(position, sources.size())), source);
}

}  // namespace

bool may_be_raster(std::string_view path) {
  constexpr std::string_view kNoNameHas("/\0", 2);
  const std::string sources = std::string(kSources) + "/";
  if (path.starts_with(sources)) path.remove_prefix(sources.size());
  return path != "." && path != ".." && path.find_first_of(kNoNameHas) == path.npos;
}

bool has_target(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kTargetFile, error);
}

bool is_changeable(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kChangesFile, error) || fs::exists(folder / kSources, error);
}

fs::path kept_store(const fs::path& folder, std::uint32_t number) {
  return folder / kVersions / (std::to_string(number) + ".sqlite");
}

std::vector<std::uint32_t> kept_numbers(const fs::path& folder, const proto::DatasetVersion& served) {
  std::vector<std::uint32_t> numbers;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / kVersions, error)) {
    const auto number = proto::number<std::uint32_t>(entry.path().stem().string());
    if (number && entry.path() == kept_store(folder, *number)) numbers.push_back(*number);
  }
  std::sort(numbers.rbegin(), numbers.rend());
  auto next = numbers.begin();
  for (std::uint32_t before = served.before(); before != 0;) {
    const auto found = std::find(next, numbers.end(), before);
    if (found == numbers.end()) break;
    std::rotate(next, found, found + 1);
    const auto version = version_in(kept_store(folder, before));
    before = version && *version ? (*version)->before() : 0;
    ++next;
  }
  return numbers;
}

proto::Result<std::optional<proto::DatasetVersion>> version_in(const fs::path& store) {
  try {
    const auto bytes = pipeline::sound_note_in(store.string(), kVersionNote);
    std::error_code error;
    if (!bytes && !fs::exists(store, error)) return std::optional<proto::DatasetVersion>();
    proto::DatasetVersion version;
    if (bytes && version.ParseFromString(*bytes) && version.number() > 0 && version.sources_size() > 0)
      return std::optional(version);
    return damaged(store, "does not say of which rasters it was made");
  } catch (const pipeline::StoreError& error) { return damaged(store, std::string("cannot be read: ") + error.what()); }
}

proto::Result<void> begin(const fs::path& folder, proto::SourceChange change) {
  proto::SourceChanges changes;
  change.set_number(1);
  changes.set_last_number(1);
  *changes.add_pending() = std::move(change);
  return write_file(folder, changes);
}

std::optional<std::string> request_with(const std::string& key, const proto::SourceChanges& changes) {
  std::optional<std::string> found;
  const auto look = [&](const auto& list) {
    for (const auto& one : list)
      if (!key.empty() && one.idempotency_key() == key) found = one.request_hash();
  };
  look(changes.ended()), look(changes.pending()), look(changes.rollbacks());
  return found;
}

proto::Result<void> note_rollback(const fs::path& folder, proto::SourceChanges changes, const proto::Rollback& rollback) {
  auto& all = *changes.mutable_rollbacks();
  *all.Add() = rollback;
  if (all.size() > kMostEnded) all.DeleteSubrange(0, all.size() - kMostEnded);
  return write_file(folder, changes);
}

proto::Result<std::vector<proto::DatasetSource>> applied(std::vector<proto::DatasetSource> sources,
                                                         const proto::SourceChange& change) {
  if (change.kind() == "add") {
    insert(sources, change.position(), change.source());
    for (int k = 0; k < change.more_size(); ++k)
      insert(sources, std::size_t{change.position()} + static_cast<std::size_t>(k) + 1, change.more(k));
    return sources;
  }
  const auto place = place_of(sources, change.source().id());
  if (place == sources.end()) return unknown(change.source().id());
  if (change.kind() == "remove") {
    if (sources.size() == 1)
      return Problem{"source-last", "this is the only raster of the dataset", "DELETE of the dataset, or another raster first",
                     ""};
    sources.erase(place);
    return sources;
  }
  const proto::DatasetSource old = *place;
  const auto position = change.has_position() ? change.position() : static_cast<std::uint32_t>(place - sources.begin());
  sources.erase(place);
  proto::DatasetSource changed = change.source();
  if (changed.spec().path().empty()) {  // another place or other options alone
    changed = old;
    *changed.mutable_spec()->mutable_options() = change.source().spec().options();
  }
  insert(sources, position, changed);
  return sources;
}

proto::SourceChanges Ledger::read(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  proto::SourceChanges changes = value_of(read_file(layout_.dataset(id)));
  const auto tried = tried_.find(id);
  for (proto::SourceChange& change : *changes.mutable_pending())
    if (tried != tried_.end() && change.id() == tried->second.change) *change.mutable_problem() = to_error(tried->second.problem);
  return changes;
}

proto::DatasetVersion Ledger::current(const std::string& id) const {
  if (!holds(id)) return {};
  const fs::path folder = layout_.dataset(id);
  // Without the lock, which who asks may hold: the file is replaced whole. The list before the version: a change may end in
  // between.
  const proto::SourceChanges changes = value_of(read_file(folder));
  return value_of(served_in(folder, changes)).value_or(proto::DatasetVersion{});
}

std::vector<proto::DatasetSource> Ledger::expected(const std::string& id) const {
  // The list before the version: a change that ends in between is applied twice, which the second look at its id prevents.
  const proto::SourceChanges changes = read(id);
  const proto::DatasetVersion version = current(id);
  std::vector<proto::DatasetSource> sources(version.sources().begin(), version.sources().end());
  for (const proto::SourceChange& change : changes.pending()) {
    if (change.id() == version.change()) continue;
    if (auto next = applied(sources, change)) sources = std::move(*next);
  }
  return sources;
}

proto::Result<void> Ledger::change(const std::string& id, const std::function<proto::Result<void>(proto::SourceChanges&)>& edit) {
  const std::lock_guard lock(mutex_);
  proto::SourceChanges changes = value_of(read_file(layout_.dataset(id)));
  if (const auto edited = edit(changes); !edited.ok()) return edited;
  if (changes.pending_size() > 0) waiting_.insert(id);
  return write_file(layout_.dataset(id), changes);
}

proto::Result<proto::SourceChange> Ledger::add(const std::string& id, proto::SourceChange added, std::size_t most,
                                               const Bring& bring) {
  if (const auto possible = applied(expected(id), added); !possible.ok()) return possible.problem();
  const auto noted = change(id, [&](proto::SourceChanges& changes) -> proto::Result<void> {
    if (static_cast<std::size_t>(changes.pending_size()) >= most) {
      return Problem{"queue-full", "as many changes of this dataset as may wait are waiting",
                     "at most " + std::to_string(most) + " changes; later again", ""};
    }
    if (const auto brought = bring(); !brought.ok()) return brought;
    changes.set_last_number(changes.last_number() + 1);
    added.set_number(changes.last_number());
    *changes.add_pending() = added;
    return {};
  });
  if (!noted.ok()) return noted.problem();
  return added;
}

proto::Result<proto::SourceChanges> Ledger::look(const std::string& id) const {
  auto changes = read_file(layout_.dataset(id));
  if (changes && changes->pending_size() > 0)
    waiting_.insert(id);
  else
    waiting_.erase(id), tried_.erase(id);
  return changes;
}

std::size_t Ledger::waiting() const {
  const std::lock_guard lock(mutex_);
  std::size_t all = 0;
  for (const std::string& id : std::set<std::string>(waiting_)) {
    const auto changes = look(id);
    if (!changes) continue;
    all += static_cast<std::size_t>(std::ranges::count_if(changes->pending(), [](const auto& one) { return one.number() > 1; }));
  }
  return all;
}

std::optional<proto::SourceChange> Ledger::first(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto changes = look(id);
  return changes && changes->pending_size() > 0 ? std::optional(changes->pending(0)) : std::nullopt;
}

std::size_t Ledger::pending(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto changes = look(id);
  return changes ? static_cast<std::size_t>(changes->pending_size()) : 0;
}

proto::Result<void> Ledger::amend(const std::string& id, const proto::SourceChange& amended) {
  return change(id, [&](proto::SourceChanges& changes) -> proto::Result<void> {
    for (proto::SourceChange& pending : *changes.mutable_pending()) {
      if (pending.id() == amended.id()) pending = amended;
    }
    return {};
  });
}

void Ledger::note_waiting(const std::string& id, const std::string& change, const Problem& problem) {
  const std::lock_guard lock(mutex_);
  tried_.insert_or_assign(id, Tried{change, problem});
}

proto::Result<void> Ledger::end(const std::string& id, const std::string& ended, const std::optional<Problem>& problem) {
  return change(id, [&](proto::SourceChanges& changes) -> proto::Result<void> {
    if (changes.pending_size() > 0 && changes.pending(0).id() == ended) end_pending(changes, 0, problem);
    return {};
  });
}

proto::Result<std::optional<Problem>> Ledger::take_back(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const std::optional<Problem> none;
  const auto tried = tried_.find(id);
  if (tried == tried_.end()) return none;
  const fs::path folder = layout_.dataset(id);
  auto changes = read_file(folder);
  const auto served = changes ? served_in(folder, *changes) : changes.problem();
  if (!served || !*served || changes->pending_size() == 0) return none;
  const proto::SourceChange& added = changes->pending(0);
  if (added.kind() != "add" || added.id() != tried->second.change) return none;
  if ((*served)->change() == added.id()) return none;  // it failed after the version had come into its place
  auto& pending = *changes->mutable_pending();
  const auto removed = std::ranges::find_if(pending, [&](const proto::SourceChange& change) {
    return change.kind() == "remove" && change.source().id() == added.source().id();
  });
  if (removed == pending.end()) return none;
  removed->set_number((*served)->number());  // which stays
  end_pending(*changes, static_cast<int>(removed - pending.begin()), std::nullopt);
  end_pending(*changes, 0, tried->second.problem);
  const auto written = write_file(folder, *changes);
  if (!written.ok()) return written.problem();
  return std::optional(tried->second.problem);
}

void Ledger::tidy(const std::string& id, std::size_t keep) {
  const std::lock_guard lock(mutex_);  // a raster that was just brought is not yet named
  const fs::path folder = layout_.dataset(id);
  const auto keep_all = [&](const Problem& why) {
    log_warning("dataset " + id + ": " + why.detail + "; none of its rasters is removed");
  };
  const auto changes = read_file(folder);
  if (!changes) return keep_all(changes.problem());
  const auto served = served_in(folder, *changes);
  if (!served) return keep_all(served.problem());
  std::set<fs::path> named = {folder / kChangesFile, folder / kSources,    folder / kVersions,
                              folder / kStoreFile,   folder / kRecordFile, folder / kDeletedFile};
  const auto name_sources = [&](const auto& sources) {
    for (const proto::DatasetSource& source : sources) named.insert(folder / source.spec().path());
  };
  if (*served) name_sources((*served)->sources());
  std::vector<fs::path> places = {folder, folder / kVersions};
  bool all_named = true;
  std::vector<std::uint32_t> kept = kept_numbers(folder, served->value_or(proto::DatasetVersion()));
  kept.resize(std::min(keep, kept.size()));
  for (const std::uint32_t number : kept) {
    named.insert(kept_store(folder, number));
    const auto version = version_in(kept_store(folder, number));
    if (version && *version) name_sources((*version)->sources());
    if (version) continue;
    all_named = false;
    keep_all(version.problem());
  }
  if (all_named) places.push_back(folder / kSources);
  for (const proto::SourceChange& change : changes->pending()) {
    named.insert(folder / change.source().spec().path());
    name_sources(change.more());
  }
  // What is being built goes on there.
  if (changes->pending_size() > 0)
    named.insert({folder / kTargetFile, folder / kJobFile, folder / kUnderWayFile, folder / kNextStore,
                  folder / (std::string(kNextStore) + "-wal")});
  const bool shows_first = changes->pending_size() > 0 && !*served;
  std::error_code ignored;
  for (const fs::path& place : places) {
    for (const auto& entry : fs::directory_iterator(place, ignored)) {
      const bool shown = shows_first && place == folder && is_shown(entry.path().filename().string());
      if (!shown && !named.contains(entry.path())) fs::remove_all(entry.path(), ignored);
    }
  }
}

void Ledger::apart(const std::function<void()>& work) {
  const std::lock_guard lock(mutex_);
  work();
}

bool Ledger::while_idle(const std::string& id, const std::function<void(const proto::SourceChanges&)>& work) {
  const std::lock_guard lock(mutex_);
  const proto::SourceChanges changes = value_of(read_file(layout_.dataset(id)));
  if (changes.pending_size() > 0) return false;
  work(changes);
  return true;
}

}  // namespace cordillera::server::updates
