#include "server/service/archive_files.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <vector>

#include "pipeline/exports/pmtiles.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/store/sqlite.h"
#include "raster/disk/write_all.h"
#include "server/datasets/library.h"
#include "server/http/digest.h"
#include "server/http/message.h"
#include "server/limits/admission.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

std::string file_of(const ArchiveOrder& order) {
  return order.id + "." + order.version + "." + std::string(order.face->name) + ".pmtiles";
}

constexpr std::size_t kBlock_bytes = std::size_t{64} << 10;  // read and compared at once: what clients ask for is about as large
constexpr std::size_t kSum_letters = 16;  // of a block's SHA-256: against damage, and 4 MiB for all that is kept

std::string sum_of(const std::string& block) { return digest(block).substr(0, kSum_letters); }

Problem too_many() {
  return {"export-too-large", "the archive would have more than " + std::to_string(ArchiveFiles::kMostTiles) + " tiles",
          "fewer over HTTP; cordillera export makes larger ones", ""};
}

proto::Result<void> write_one(const ArchiveOrder& order, const fs::path& path, const pipeline::exports::ArchiveBounds& bounds) {
  try {
    auto written = pipeline::exports::write_pmtiles(*order.terrain, *order.face, path.string(), bounds);
    return !written && written.problem().type == "service-busy" ? wants_descriptor(order.id) : written;
  } catch (const pipeline::NoDescriptor&) { return wants_descriptor(order.id); } catch (const std::bad_alloc&) {
    return Problem{"service-busy", "there is no memory to make an archive of dataset " + order.id, "asking again later", ""};
  } catch (const std::exception& error) {  // tiles that cannot be decoded
    return Problem{"store-damaged", error.what(), "", ""};
  }
}

}  // namespace

std::shared_ptr<const ArchiveFile> ArchiveFile::open(const fs::path& path, std::shared_ptr<const ArchiveSums> sums) {
  raster::Descriptor opened(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!opened.is_open()) return nullptr;
  const std::shared_ptr<ArchiveFile> file(new ArchiveFile(std::move(opened)));
  try {
    file->sums_ = std::move(sums);
    if (!file->sums_) file->take_sums();
  } catch (const ArchiveDamaged&) { return nullptr; }
  return file;
}

void ArchiveFile::take_sums() {
  struct stat now {};
  if (fstat(file_.number(), &now) != 0) throw ArchiveDamaged("an archive cannot be read");
  ArchiveSums sums;
  sums.size = static_cast<std::uint64_t>(now.st_size);
  Digest all;
  for (std::uint64_t number = 0; number * kBlock_bytes < sums.size; ++number) {
    const std::string bytes = block(number, sums.size);
    all.add(bytes);
    sums.blocks += sum_of(bytes);
  }
  sums.etag = quoted(all.finish().substr(0, 32));
  sums_ = std::make_shared<const ArchiveSums>(std::move(sums));
}

/// As it is on the disk.
std::string ArchiveFile::block(std::uint64_t number, std::uint64_t size) const {
  const std::uint64_t first = number * kBlock_bytes;
  if (first >= size) throw ArchiveDamaged("an archive ends early");
  std::string bytes(static_cast<std::size_t>(std::min<std::uint64_t>(kBlock_bytes, size - first)), '\0');
  if (!raster::read_all_at(file_.number(), bytes, first)) throw ArchiveDamaged("an archive cannot be read");
  return bytes;
}

std::string ArchiveFile::read(std::uint64_t first, std::size_t count) const {
  try {
    std::string bytes;
    bytes.reserve(count);
    for (std::uint64_t number = first / kBlock_bytes; bytes.size() < count; ++number) {
      const std::string whole = block(number, size());
      if (sums_->blocks.compare(static_cast<std::size_t>(number) * kSum_letters, kSum_letters, sum_of(whole)) != 0)
        throw ArchiveDamaged("an archive is not what was written");
      const std::size_t skip = bytes.empty() ? static_cast<std::size_t>(first - number * kBlock_bytes) : 0;
      bytes.append(whole, skip, count - bytes.size());
    }
    return bytes;
  } catch (const ArchiveDamaged&) {
    damaged_ = true;
    throw;
  }
}

ArchiveFiles::ArchiveFiles(fs::path folder, limits::Space& space, Told made, std::size_t most_open)
    : folder_(std::move(folder)), space_(space), made_(std::move(made)), most_open_(most_open) {
  std::error_code ignored;  // making one will fail and say so
  fs::remove_all(folder_, ignored);
  fs::create_directories(folder_, ignored);
  thread_ = std::thread([this] { work(); });
}

ArchiveFiles::~ArchiveFiles() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

proto::Result<std::shared_ptr<const ArchiveFile>> ArchiveFiles::find(const ArchiveOrder& order, Asks asks) {
  const std::string name = file_of(order);
  const std::lock_guard lock(mutex_);
  auto known = entries_.find(name);
  bool lost = known != entries_.end() && known->second->told && asks == Asks::first;
  if (known != entries_.end() && known->second->sums) {
    Entry& entry = *known->second;
    if (!entry.file) entry.file = ArchiveFile::open(entry.path, entry.sums);
    if (!entry.file && raster::is_want_of_descriptors(errno)) return wants_descriptor(order.id);
    lost = !entry.file || entry.file->damaged();
  }
  if (lost) {  // it is made anew
    std::error_code ignored;
    fs::remove(known->second->path, ignored);
    entries_.erase(known);
    known = entries_.end();
  }
  if (known == entries_.end()) {
    if (waiting_.size() >= kMostWaiting)
      return Problem{"service-busy", "too many archives are waiting to be made", "asking again later", ""};
    const auto entry = std::make_shared<Entry>();
    entry->order = order;
    entry->path = folder_ / name;
    entry->used = ++clock_;
    entries_[name] = entry;
    waiting_.push_back(entry);
    changed_.notify_all();
    return std::shared_ptr<const ArchiveFile>();
  }
  Entry& entry = *known->second;
  entry.used = ++clock_;
  if (!entry.problem) {
    const auto file = entry.file;
    close_idle();
    return file;
  }
  entry.told = true;
  return *entry.problem;
}

bool ArchiveFiles::is_awaited(const ArchiveOrder& order) const {
  const std::lock_guard lock(mutex_);
  const auto known = entries_.find(file_of(order));
  return known != entries_.end() && !known->second->sums && !known->second->problem;
}

void ArchiveFiles::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  std::erase_if(waiting_, [&](const Kept& entry) { return entry->order.id == id; });
  std::error_code ignored;
  for (auto at = entries_.begin(); at != entries_.end();) {
    const bool goes = at->second->order.id == id;
    if (goes) {
      at->second->forgotten = true;
      fs::remove(at->second->path, ignored);
    }
    at = goes ? entries_.erase(at) : std::next(at);
  }
}

void ArchiveFiles::work() {
  setpriority(PRIO_PROCESS, 0, 10);  // of this thread alone: who reads tiles goes first
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return stop_ || !waiting_.empty(); });
    if (stop_) return;
    const Kept entry = waiting_.front();
    waiting_.pop_front();
    lock.unlock();
    try {
      make(*entry);
      made_(entry->order.id);
    } catch (const std::exception&) {
      // Want of memory, for words too. Outside of this thread it would end the service.
    }
    lock.lock();
    // Who asks again has it tried again.
    if (!entry->sums && !entry->problem) std::erase_if(entries_, [&](const auto& one) { return one.second == entry; });
  }
}

/// Why it is made no further.
std::optional<Problem> ArchiveFiles::ended(const Entry& entry) const {
  if (stop_) return Problem{"service-stopping", "the service is stopping", "trying again later", ""};
  return entry.forgotten ? std::optional(pipeline::exports::kStopped) : std::nullopt;
}

/// What is read of an entry by others changes under the lock alone.
void ArchiveFiles::make(Entry& entry) {
  std::string full;
  const auto claim = space_.claim_for_spare(0, &full);
  pipeline::exports::ArchiveBounds bounds;
  std::uint64_t bytes = 0;
  bounds.tiles = [&](std::uint64_t tiles) {
    auto end = ended(entry);
    return !end && tiles > kMostTiles ? std::optional(too_many()) : end;
  };
  bounds.bytes = [&](std::uint64_t more) -> std::optional<Problem> {
    if (auto end = ended(entry)) return end;
    bytes += more;
    if (bytes > kMostBytes)
      return Problem{"export-too-large", "the archive would be larger than this service keeps", "cordillera export", ""};
    full = claim->next(more);
    return full.empty() ? std::nullopt : std::optional(limits::storage_full(full));
  };
  auto written = claim ? write_one(entry.order, entry.path, bounds) : proto::Result<void>(limits::storage_full(full));
  auto file = written ? ArchiveFile::open(entry.path, nullptr) : nullptr;
  if (written && !file)
    written = raster::is_want_of_descriptors(errno)
                  ? wants_descriptor(entry.order.id)
                  : Problem{"storage-full", "the archive cannot be read back", "trying again later", ""};
  const std::lock_guard lock(mutex_);
  entry.order.terrain = nullptr;
  if (!written)
    entry.problem =
        written.problem().type == "output-failed" ? limits::storage_full(written.problem().detail) : written.problem();
  if (file) entry.sums = file->sums();
  entry.file = std::move(file);
  const auto known = entries_.find(entry.path.filename().string());
  std::error_code ignored;
  if (!written) fs::remove(entry.path, ignored);  // whole, and not to be read back
  if (known == entries_.end() || known->second.get() != &entry)
    fs::remove(entry.path, ignored);  // forgotten meanwhile
  else
    make_room(known->first);
  close_idle();
}

/// Which are read now are bounded by the connections that read them.
void ArchiveFiles::close_idle() {
  std::vector<Entry*> idle;
  for (const auto& [name, entry] : entries_)
    if (entry->file && entry->file.use_count() == 1) idle.push_back(entry.get());
  if (idle.size() <= most_open_) return;
  std::sort(idle.begin(), idle.end(), [](const Entry* one, const Entry* other) { return one->used < other->used; });
  for (std::size_t k = 0; k < idle.size() - most_open_; ++k)
    if (!idle[k]->file->damaged()) idle[k]->file = nullptr;  // else it is made anew
}

/// Of those that may go the one that was asked for longest ago; end where there is none.
std::map<std::string, ArchiveFiles::Kept>::iterator ArchiveFiles::oldest(const MayGo& may_go) {
  auto found = entries_.end();
  for (auto at = entries_.begin(); at != entries_.end(); ++at) {
    if (may_go(at->first, *at->second) && (found == entries_.end() || at->second->used < found->second->used)) found = at;
  }
  return found;
}

std::uint64_t ArchiveFiles::remove(std::map<std::string, Kept>::iterator one) {
  const std::uint64_t size = one->second->sums ? one->second->sums->size : 0;
  std::error_code ignored;
  fs::remove(one->second->path, ignored);
  entries_.erase(one);
  return size;
}

void ArchiveFiles::make_room(const std::string& but) {
  std::uint64_t all = 0;
  for (const auto& [name, entry] : entries_) all += entry->sums ? entry->sums->size : 0;
  while (all > kMostBytes || entries_.size() > kMostKept) {
    const auto one =
        oldest([&](const std::string& name, const Entry& entry) { return name != but && (entry.sums || entry.problem); });
    if (one == entries_.end()) return;
    all -= remove(one);
  }
}

bool ArchiveFiles::spare(std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  std::uint64_t freed = 0;
  // A problem is still to be told.
  const auto is_made = [](const std::string&, const Entry& entry) { return entry.sums != nullptr; };
  for (auto one = oldest(is_made); one != entries_.end() && freed < bytes; one = oldest(is_made)) freed += remove(one);
  return freed > 0;
}

}  // namespace cordillera::server
