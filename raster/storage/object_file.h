#pragma once
// A file that is read in pieces, here or in object storage, and stays the same file while it is: when another one takes its name,
// reading fails, and what was read before was all of one version.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "proto/result.h"
#include "raster/storage/block_cache.h"

namespace cordillera::raster {

/// Thread-safe.
class ObjectFile {
 public:
  /// path: as in raster/storage/storage.h. "storage-read" when there is no such file or it cannot be asked for.
  static proto::Result<std::shared_ptr<ObjectFile>> open(const std::string& path, std::shared_ptr<BlockCache> cache);
  ~ObjectFile();
  ObjectFile(const ObjectFile&) = delete;
  ObjectFile& operator=(const ObjectFile&) = delete;

  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  /// offset + count within the size. "storage-read": may succeed another time, and not at once: for a second after a failure the
  /// storage is not asked. "storage-changed": never again, for another file has the name; what is in the cache can still be read.
  proto::Result<void> read(std::uint64_t offset, std::size_t count, char* out);
  /// Asks the storage: false when another file, or none, has the name.
  proto::Result<bool> unchanged();
  /// Of the last read that failed.
  std::optional<proto::Problem> trouble() const;

  /// What is fetched at once. Neighbouring tiles lie beside each other; twice as much would double the wait for the first of
  /// them.
  static constexpr std::size_t kBlock_bytes = 128 << 10;

 private:
  struct Handle;
  ObjectFile(std::string path, std::shared_ptr<BlockCache> cache);
  proto::Result<BlockCache::Piece> block(std::uint64_t number);
  proto::Problem changed() const;
  proto::Problem failed(const proto::Problem& problem);

  const std::string path_;
  const std::shared_ptr<BlockCache> cache_;
  const std::uint64_t number_;  ///< in the cache
  std::unique_ptr<Handle> handle_;
  std::string state_;
  std::uint64_t size_ = 0;
  mutable std::mutex mutex_;
  std::optional<proto::Problem> trouble_;
  std::chrono::steady_clock::time_point failed_{};
  bool changed_ = false;
};

}  // namespace cordillera::raster
