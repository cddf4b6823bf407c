#pragma once
// Archives of tiles for maps, read: PMTiles, version 3, and MBTiles, by whoever made them. What fails throws Refused, or
// StoreError where SQLite cannot read.
#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "pipeline/encode/json.h"
#include "pipeline/exports/tile_places.h"
#include "proto/result.h"

namespace cordillera::pipeline::exports {

/// Finest zoom that is taken: of longer numbers an archive is damaged.
inline constexpr int kMostArchiveZoom = 30;

/// Tiles that are taken.
inline constexpr std::uint64_t kMostArchived = 1000000;

inline proto::Problem too_many_archived() {
  return {"archive-too-large", "the archive holds more than a million tiles, and they are unpacked to be shown",
          "the .sqlite file that it was made of, or a part of it: cordillera export --bbox", "path"};
}

/// "archive-unreadable", with why.
inline proto::Problem unreadable(const std::string& path, const std::string& why) {
  return {"archive-unreadable", path + " cannot be read: " + why, "a complete, undamaged archive of tiles", "path"};
}

struct ArchivedTile {
  SquareAddress at;
  std::string_view bytes;
  bool again = false;  ///< they are those of the tile before
};

struct ArchiveSize {
  std::uint64_t tiles = 0;
  std::uint64_t bytes = 0;  ///< as they lie in the archive, each run of equal tiles once
};

class ArchiveReader {
 public:
  using Take = std::function<void(const ArchivedTile& tile)>;

  virtual ~ArchiveReader() = default;
  /// What it says of itself, with MBTiles' names: of text are "name", "format" ("png", "pbf") and "bounds"
  /// ("west,south,east,north").
  virtual const Json& metadata() const = 0;
  /// Nothing where it is known only when all tiles are read.
  virtual std::optional<ArchiveSize> size() = 0;
  /// How many tiles each zoom has; none is read.
  virtual std::map<int, std::uint64_t> tiles_by_zoom() = 0;
  /// Every tile, not compressed beyond its own format. Memory does not grow with the archive.
  virtual void each_tile(const Take& take) = 0;
};

std::unique_ptr<ArchiveReader> open_pmtiles(const std::string& path);
/// stop: ends what is read, with StoreError, also within a row: it may be one that a view computes. May be null.
std::unique_ptr<ArchiveReader> open_mbtiles(const std::string& path, const std::atomic<bool>* stop);

}  // namespace cordillera::pipeline::exports
