#pragma once
// Archives of datasets (PMTiles) that were asked for, as files: made once, one after the other, then served by ranges.
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>

#include "pipeline/faces/face.h"
#include "proto/result.h"
#include "raster/disk/descriptor.h"
#include "server/limits/space.h"

namespace cordillera::server {

class ArchiveDamaged : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What an archive was when it had been written.
struct ArchiveSums {
  std::uint64_t size = 0;
  std::string etag;    ///< of its bytes, in quotes
  std::string blocks;  ///< of its blocks, kSum_letters each
};

/// An archive on disk, open: it can be read as long as somebody holds it, removed or not.
class ArchiveFile {
 public:
  /// sums: of an earlier look at it; null: they are taken now. Null: it cannot be opened, and errno says why.
  static std::shared_ptr<const ArchiveFile> open(const std::filesystem::path& path, std::shared_ptr<const ArchiveSums> sums);
  std::uint64_t size() const { return sums_->size; }
  const std::string& etag() const { return sums_->etag; }
  const std::shared_ptr<const ArchiveSums>& sums() const { return sums_; }
  /// Throws ArchiveDamaged where they are not there, or not those that were there when it was opened.
  std::string read(std::uint64_t first, std::size_t count) const;
  /// Whether a read has found that.
  bool damaged() const { return damaged_; }

 private:
  explicit ArchiveFile(raster::Descriptor file) : file_(std::move(file)) {}
  void take_sums();
  std::string block(std::uint64_t number, std::uint64_t size) const;
  raster::Descriptor file_;
  std::shared_ptr<const ArchiveSums> sums_;
  mutable std::atomic<bool> damaged_{false};
};

/// What an archive is of.
struct ArchiveOrder {
  std::string id, version;  ///< of the dataset
  const pipeline::faces::Face* face = nullptr;
  std::shared_ptr<const pipeline::faces::Terrain> terrain;
};

/// again: who was told that it is being made, and waited for that.
enum class Asks : std::uint8_t { first, again };

/// Thread-safe.
class ArchiveFiles {
 public:
  using Told = std::function<void(const std::string& id)>;
  /// folder: is emptied. made: called whenever an order has come to its end, on another thread. most_open: of those that nobody
  /// reads.
  ArchiveFiles(std::filesystem::path folder, limits::Space& space, Told made, std::size_t most_open = kMostOpen);
  ~ArchiveFiles();

  /// The archive; null while it is being made, which begins with the first who asks. Problems: "export-too-large",
  /// "service-busy", "storage-full", and those of the format. A problem is told to the first who asks and to all who waited; the
  /// next who asks has it tried again.
  proto::Result<std::shared_ptr<const ArchiveFile>> find(const ArchiveOrder& order, Asks asks = Asks::first);
  /// Whether it is being made. Tells no problem, and begins nothing.
  bool is_awaited(const ArchiveOrder& order) const;
  /// Archives of a dataset go: it has another version, or there is none any more. One that is being made ends.
  void forget(const std::string& id);
  /// Removes archives, those that were asked for longest ago first, until so many bytes are free. False: there is none. What
  /// somebody reads takes its room until then.
  bool spare(std::uint64_t bytes);

  static constexpr std::uint64_t kMostTiles = 100'000;                  ///< of an archive
  static constexpr std::uint64_t kMostBytes = std::uint64_t{16} << 30;  ///< of all together
  static constexpr std::size_t kMostKept = 4096;                        ///< however small they are
  static constexpr std::size_t kMostOpen = 16;
  static constexpr std::size_t kMostWaiting = 16;

 private:
  struct Entry {
    ArchiveOrder order;                       ///< its terrain goes when it is made
    std::shared_ptr<const ArchiveSums> sums;  ///< null: it is not made yet
    std::shared_ptr<const ArchiveFile> file;  ///< null: it is not open
    std::optional<proto::Problem> problem;
    std::filesystem::path path;
    std::uint64_t used = 0;
    bool told = false;                   ///< somebody, of the problem
    std::atomic<bool> forgotten{false};  ///< nobody can have it any more: its making ends
  };
  using Kept = std::shared_ptr<Entry>;
  void work();
  void make(Entry& entry);
  std::optional<proto::Problem> ended(const Entry& entry) const;
  void make_room(const std::string& but);
  using MayGo = std::function<bool(const std::string& name, const Entry& entry)>;
  std::map<std::string, Kept>::iterator oldest(const MayGo& may_go);
  /// Returns the bytes that it had.
  std::uint64_t remove(std::map<std::string, Kept>::iterator one);
  void close_idle();

  const std::filesystem::path folder_;
  limits::Space& space_;
  const Told made_;
  const std::size_t most_open_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Kept> entries_;  ///< by the name of the file
  std::deque<Kept> waiting_;
  std::uint64_t clock_ = 0;
  std::thread thread_;  ///< last: it uses the rest
};

}  // namespace cordillera::server
