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

/// An archive on disk, open: it can be read as long as somebody holds it, removed or not.
class ArchiveFile {
 public:
  /// Null: it cannot be opened.
  static std::shared_ptr<const ArchiveFile> open(const std::filesystem::path& path);
  std::uint64_t size() const { return size_; }
  const std::string& etag() const { return etag_; }  ///< of its bytes, in quotes
  /// Throws ArchiveDamaged where they are not there, or not those that were there when it was opened.
  std::string read(std::uint64_t first, std::size_t count) const;
  /// Whether a read has found that.
  bool damaged() const { return damaged_; }

 private:
  explicit ArchiveFile(raster::Descriptor file) : file_(std::move(file)) {}
  void take_sums();
  std::string block(std::uint64_t number) const;
  raster::Descriptor file_;
  std::uint64_t size_ = 0;
  std::string etag_;
  std::string sums_;  ///< of its blocks, kSum_letters each
  mutable std::atomic<bool> damaged_{false};
};

/// What an archive is of.
struct ArchiveOrder {
  std::string id, version;  ///< of the dataset
  const pipeline::faces::Face* face = nullptr;
  std::shared_ptr<const pipeline::faces::Terrain> terrain;
};

/// Thread-safe.
class ArchiveFiles {
 public:
  using Told = std::function<void(const std::string& id)>;
  /// folder: is emptied. made: called whenever an order has come to its end, on another thread.
  ArchiveFiles(std::filesystem::path folder, limits::Space& space, Told made);
  ~ArchiveFiles();

  /// The archive; null while it is being made, which begins with the first who asks. Problems: "export-too-large",
  /// "service-busy", "storage-full", and those of the format. A problem is told once; who asks again has it tried again.
  proto::Result<std::shared_ptr<const ArchiveFile>> find(const ArchiveOrder& order);
  /// Archives of a dataset go: it has another version, or there is none any more.
  void forget(const std::string& id);

  static constexpr std::uint64_t kMostTiles = 100'000;                  ///< of an archive
  static constexpr std::uint64_t kMostBytes = std::uint64_t{16} << 30;  ///< of all together
  static constexpr std::size_t kMostWaiting = 16;

 private:
  struct Entry {
    ArchiveOrder order;  ///< its terrain goes when it is made
    std::shared_ptr<const ArchiveFile> file;
    std::optional<proto::Problem> problem;
    std::filesystem::path path;
    std::uint64_t used = 0;
  };
  using Kept = std::shared_ptr<Entry>;
  void work();
  void make(Entry& entry);
  void make_room(const std::string& but);

  const std::filesystem::path folder_;
  limits::Space& space_;
  const Told made_;
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Kept> entries_;  ///< by the name of the file
  std::deque<Kept> waiting_;
  std::uint64_t clock_ = 0;
  std::thread thread_;  ///< last: it uses the rest
};

}  // namespace cordillera::server
