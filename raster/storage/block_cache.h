#pragma once
// Pieces of files that were read lately, up to so many bytes in all.
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "proto/lru.h"

namespace cordillera::raster {

/// Thread-safe. A piece belongs to one opened file, never to a name, behind which there may be another file tomorrow.
class BlockCache {
 public:
  explicit BlockCache(std::uint64_t most_bytes) : most_(most_bytes), pieces_(most_bytes) {}

  using Piece = std::shared_ptr<const std::string>;
  /// File and number of the block.
  using Key = std::pair<std::uint64_t, std::uint64_t>;

  /// A number that no other file has.
  std::uint64_t new_file() { return ++files_; }
  /// Null when it is not here.
  Piece find(const Key& key) { return pieces_.find(key).value_or(nullptr); }
  /// Whatever was used longest ago makes room.
  void keep(const Key& key, const Piece& piece) { pieces_.keep(key, piece, piece->size()); }
  void forget(std::uint64_t file) { pieces_.remove_range({file, 0}, {file, UINT64_MAX}); }

  std::uint64_t bytes() const { return pieces_.bytes(); }
  std::uint64_t most_bytes() const { return most_; }

 private:
  const std::uint64_t most_;
  std::atomic<std::uint64_t> files_ = 0;
  proto::Lru<Key, Piece> pieces_;
};

}  // namespace cordillera::raster
