#include "server/service/live_cache.h"

#include <algorithm>
#include <vector>

#include "pipeline/store/mesh_files.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/ledger.h"
#include "server/fetch/addresses.h"
#include "server/fetch/listed_rasters.h"
#include "server/limits/disk.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr auto kInUse = std::chrono::seconds(5);         // since somebody read it
constexpr auto kBetweenLooks = std::chrono::seconds(1);  // at the disk: steps of a build come faster

/// It has an address, and somebody has posted it: it is not deleted for want of room.
bool is_posted(const Dataset& dataset) { return !dataset.body_hash.empty(); }

}  // namespace

LiveCache::LiveCache(Parts parts) : parts_(std::move(parts)) {
  std::error_code error;
  for (const Row& row : parts_.registry.list()) {
    if (row->address.empty()) continue;
    if (!is_posted(*row)) ids_.emplace(row->options_hash, row->id);  // the newest first
    entries_[row->id].asleep = row->state == State::running && !fs::exists(parts_.layout.dataset(row->id) / row->raster, error);
  }
  keeping_ = std::jthread([this](const std::stop_token& stop) { keep_within(stop); });
  for (std::jthread& asking : asking_) asking = std::jthread([this](const std::stop_token& stop) { ask_addresses(stop); });
}

Row LiveCache::find(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto id = ids_.find(key);
  if (id == ids_.end()) return nullptr;
  if (Row row = parts_.registry.find(id->second)) return row;
  entries_.erase(id->second);  // deleted
  ids_.erase(id);
  return nullptr;
}

proto::Result<Row> LiveCache::find_or_make(const std::string& key, const std::function<proto::Result<Row>()>& make) {
  const std::lock_guard alone(making_);
  if (Row found = find(key)) return found;
  auto made = make();
  if (!made) return made;
  const std::lock_guard lock(mutex_);
  ids_[key] = (*made)->id;
  Entry& entry = entries_[(*made)->id];
  entry.read = entry.asked = entry.begun = Clock::now();
  entry.woken = true;
  return made;
}

proto::Result<limits::Slot> LiveCache::enter(const std::string& client) {
  release_places();
  return parts_.admission.enter(client, std::nullopt, limits::Entry::address);
}

void LiveCache::hold(const std::string& id, limits::Slot place) {
  const std::lock_guard lock(mutex_);
  entries_[id].place = std::move(place);
}

/// Of rasters that have come, or will not.
void LiveCache::release_places() {
  std::vector<limits::Slot> over;  // before the lock: they have one of their own
  const std::lock_guard lock(mutex_);
  for (auto at = entries_.begin(); at != entries_.end();) {
    Entry& entry = at->second;
    const Row row = parts_.registry.find(at->first);
    std::error_code error;
    // It may have been fetched ahead of its turn, or as much of it as a first look took.
    const auto has_come = [&] {
      return fs::exists(parts_.layout.dataset(at->first) / row->raster, error) ||
             fs::exists(parts_.layout.provisional(at->first), error);
    };
    const bool waits = row && entry.place && (row->state == State::queued || row->state == State::running) && !has_come();
    if (!waits && entry.place) over.push_back(std::move(entry.place)), entry.place = nullptr;
    at = row ? std::next(at) : entries_.erase(at);
  }
}

Row LiveCache::oldest() const {
  const std::lock_guard lock(mutex_);
  Row found;
  Clock::time_point read = Clock::now() - kInUse;
  for (const auto& [id, entry] : entries_) {
    const Row row = entry.read <= read ? parts_.registry.find(id) : nullptr;
    if (!row || row->address.empty() || is_posted(*row) || row->state == State::queued) continue;
    found = row;
    read = entry.read;
  }
  return found;
}

bool LiveCache::is_kept(const Dataset& dataset) const {
  return !dataset.address.empty() || (is_lazy(dataset) && dataset.state != State::ready && dataset.state != State::failed);
}

bool LiveCache::note_read(const Dataset& dataset, const std::string& client) {
  if (!is_kept(dataset)) return false;
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_[dataset.id];
  const auto now = Clock::now();
  if (is_posted(dataset) && entry.asked == Clock::time_point())
    entry.asked = entry.begun = now;  // its raster may still be on its way
  entry.read = now;
  const bool failed = dataset.state == State::failed && now - entry.begun >= parts_.fresh;
  if (entry.asleep || failed) {
    if (parts_.registry.counts().queued >= parts_.most_queued) return true;  // it comes when there is room
    entry.asleep = false;
    entry.woken = true;
    entry.begun = entry.asked = now;
    wake(dataset, client);
  } else if (!dataset.address.empty() && !entry.is_to_be_asked && now - entry.asked >= parts_.fresh &&
             dataset.state != State::failed) {
    entry.is_to_be_asked = true;
    to_ask_.emplace_back(dataset.id, updates::host_and_target(dataset.address).first);
    changed_.notify_all();
  }
  return entry.woken || !dataset.address.empty();
}

void LiveCache::wake(const Dataset& dataset, const std::string& client) {
  log_info("dataset " + dataset.id + ": woken, for it is read");
  parts_.registry.set_state(dataset.id, State::queued, std::nullopt);
  parts_.queue.enqueue(dataset.id, client);
}

bool LiveCache::is_asleep(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto entry = entries_.find(id);
  return entry != entries_.end() && entry->second.asleep;
}

void LiveCache::touch() {
  const std::lock_guard lock(mutex_);
  touched_ = true;
  changed_.notify_all();
}

std::uint64_t LiveCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

/// On disk, of what can be had again: a raster that was posted cannot.
std::uint64_t LiveCache::bytes_of(const Dataset& dataset) const {
  const fs::path folder = parts_.layout.dataset(dataset.id);
  std::uint64_t bytes = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    const bool made =
        name.starts_with(kStoreFile) || name.starts_with(updates::kNextStore) || name.starts_with(kProvisionalStore);
    if (made || (!dataset.address.empty() && !is_record(name))) bytes += limits::bytes_on_disk(entry.path());
  }
  return bytes;
}

/// In an order in which a service that is killed meanwhile finds a build that is to be done.
void LiveCache::forget_files(const Dataset& dataset) const {
  pipeline::remove_store(parts_.layout.store(dataset.id).string());
  pipeline::remove_store((parts_.layout.dataset(dataset.id) / updates::kNextStore).string());
  pipeline::remove_store(parts_.layout.provisional(dataset.id).string());
  std::error_code ignored;
  // Before its map and what it names: without it nothing of them is looked at.
  if (!dataset.address.empty()) fs::remove(parts_.layout.dataset(dataset.id) / dataset.raster, ignored);
  for (const auto& entry : fs::directory_iterator(parts_.layout.dataset(dataset.id), ignored)) {
    const fs::path name = entry.path().filename();
    const bool goes = dataset.address.empty() ? is_finest_store(name.string()) : !is_record(name);
    if (goes) fs::remove_all(entry.path(), ignored);
  }
}

/// False: it is being built, or read.
bool LiveCache::put_to_sleep(const Dataset& dataset) {
  bool slept = false;
  parts_.queue.while_idle(dataset.id, [&] {
    {
      const std::lock_guard lock(mutex_);
      Entry& entry = entries_[dataset.id];
      const Row row = parts_.registry.find(dataset.id);
      if (!row || entry.asleep || row->state == State::queued || row->state == State::failed ||
          Clock::now() - entry.read < kInUse)
        return;
      parts_.registry.set_state(dataset.id, State::running, std::nullopt);
      entry.asleep = true;  // from here on who reads it waits for what is made anew
    }
    forget_files(dataset);
    slept = true;
  });
  if (!slept) return false;
  parts_.changed(dataset.id);
  parts_.metrics.live_forgotten.add(1, {dataset.address.empty() ? "blocks" : "address"});
  log_info("dataset " + dataset.id +
           (dataset.address.empty() ? ": the blocks that were made of it are" : ": what was fetched and made of it is") +
           " forgotten");
  return true;
}

/// How much is kept after what was used longest ago has gone.
std::uint64_t LiveCache::trim() {
  std::vector<Kept> all;
  std::uint64_t bytes = 0;
  for (const Row& row : parts_.registry.list()) {
    if (!is_kept(*row)) continue;
    all.push_back({row, bytes_of(*row)});
    bytes += all.back().bytes;
  }
  if (parts_.most_bytes == 0 || bytes <= parts_.most_bytes) return bytes;
  std::map<std::string, Clock::time_point> read;
  {
    const std::lock_guard lock(mutex_);
    for (const Kept& kept : all) read[kept.row->id] = entries_[kept.row->id].read;
  }
  std::sort(all.begin(), all.end(), [&](const Kept& a, const Kept& b) {
    return std::pair(read[a.row->id], a.row->number) < std::pair(read[b.row->id], b.row->number);
  });
  for (const Kept& kept : all) {
    if (bytes <= parts_.most_bytes) break;
    if (kept.bytes > 0 && put_to_sleep(*kept.row)) bytes -= std::min(bytes, kept.bytes);
  }
  return bytes;
}

void LiveCache::keep_within(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (!touched_) changed_.wait(lock, stop, [this] { return touched_; });
    touched_ = false;
    lock.unlock();
    std::uint64_t bytes = 0;
    try {
      release_places();
      bytes = trim();
    } catch (const std::exception& error) {  // the registry's, or want of memory
      log_warning(std::string("what is kept of live datasets cannot be looked at: ") + error.what());
    }
    lock.lock();
    bytes_ = bytes;
    changed_.wait_for(lock, stop, kBetweenLooks, [] { return false; });
    touched_ = touched_ || (parts_.most_bytes > 0 && bytes > parts_.most_bytes);  // those in use will not be so for ever
  }
}

/// What has become of some of the rasters that the dataset's list names: of the next ones each time, for there may be thousands.
/// unknown: of those that were asked for, it is not known that one is another.
updates::Still LiveCache::ask_listed(const std::string& id, const std::stop_token& stop) {
  using updates::Still;
  constexpr int kAtOnce = 16;
  constexpr std::chrono::seconds kLongest{10};  // others wait to be asked
  const auto listed = updates::read_listed(parts_.layout.dataset(id));
  if (!listed || listed->rasters().empty()) return Still::changed;  // nothing is known of them any more
  const int count = listed->rasters_size();
  int first = 0;
  {
    const std::lock_guard lock(mutex_);
    Entry& entry = entries_[id];
    first = entry.next_listed % count;
    entry.next_listed = first + kAtOnce;
  }
  const auto stopped = [&stop, end = Clock::now() + kLongest] { return stop.stop_requested() || Clock::now() > end; };
  for (int k = 0; k < std::min(kAtOnce, count); ++k) {
    const proto::ListedRaster& raster = listed->rasters((first + k) % count);
    const Still still = parts_.ask(raster.address(), updates::print_of(raster), stopped);
    if (still != Still::same) return still;
  }
  return Still::same;
}

void LiveCache::ask_address(const std::string& id, const std::stop_token& stop) {
  const Row row = parts_.registry.find(id);
  const auto print = row ? fetched_print(parts_.layout.dataset(id)) : std::nullopt;
  // Of one that is still fetched for the first time there is nothing to compare with, and its fetch is under way.
  const bool is_coming = row && !print && (row->state == State::queued || row->state == State::running);
  updates::Still still = !row || is_coming ? updates::Still::unknown
                         : print           ? parts_.ask(row->address, *print, [&stop] { return stop.stop_requested(); })
                                           : updates::Still::changed;
  if (print && print->list && still != updates::Still::changed && still != updates::Still::gone)
    if (const auto listed = ask_listed(id, stop); listed != updates::Still::same) still = listed;
  constexpr const char* kOutcomes[] = {"same", "changed", "gone", "unknown"};
  if (row) parts_.metrics.live_asked.add(1, {kOutcomes[static_cast<std::size_t>(still)]});
  if (still == updates::Still::changed || still == updates::Still::gone) {
    log_info("dataset " + id + ": its address has something else now, or nothing");
    parts_.queue.fetch_anew(id);
  }
}

void LiveCache::ask_addresses(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    auto next = to_ask_.end();
    changed_.wait(lock, stop, [&] {
      next = std::find_if(to_ask_.begin(), to_ask_.end(), [this](const auto& one) { return !asked_hosts_.contains(one.second); });
      return next != to_ask_.end();
    });
    if (stop.stop_requested()) return;
    const auto [id, host] = *next;
    to_ask_.erase(next);
    asked_hosts_.insert(host);
    lock.unlock();
    try {
      ask_address(id, stop);
    } catch (const std::exception& error) { log_warning("dataset " + id + ": " + error.what()); }
    lock.lock();
    asked_hosts_.erase(host);
    if (const auto entry = entries_.find(id); entry != entries_.end()) {
      entry->second.is_to_be_asked = false;
      entry->second.asked = Clock::now();  // a host that takes its time is asked less often
    }
    changed_.notify_all();
  }
}

}  // namespace cordillera::server
