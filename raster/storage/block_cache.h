#pragma once
// Pieces of files that were read lately, up to so many bytes in all.
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace cordillera::raster {

/// Thread-safe. A piece belongs to one opened file, never to a name, behind which there may be another file tomorrow.
class BlockCache {
 public:
  explicit BlockCache(std::uint64_t most_bytes) : most_(most_bytes) {}

  using Piece = std::shared_ptr<const std::string>;
  /// File and number of the block.
  using Key = std::pair<std::uint64_t, std::uint64_t>;

  /// A number that no other file has.
  std::uint64_t new_file();
  /// Null when it is not here.
  Piece find(const Key& key);
  /// Whatever was used longest ago makes room.
  void keep(const Key& key, Piece piece);
  void forget(std::uint64_t file);

  std::uint64_t bytes() const;
  std::uint64_t most_bytes() const { return most_; }

 private:
  using Entries = std::list<std::pair<Key, Piece>>;
  void drop(Entries::iterator entry);

  const std::uint64_t most_;
  mutable std::mutex mutex_;
  std::uint64_t bytes_ = 0, files_ = 0;
  Entries entries_;  ///< the last used first
  std::map<Key, Entries::iterator> places_;
};

}  // namespace cordillera::raster
