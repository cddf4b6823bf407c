#pragma once
// Archives of tiles for maps, read: PMTiles, version 3, and MBTiles, by whoever made them. What fails throws Refused, or
// StoreError where SQLite cannot read.
#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "pipeline/encode/json.h"
#include "pipeline/exports/tile_places.h"
#include "proto/result.h"

namespace cordillera::pipeline::exports {

/// Finest zoom that is taken: of longer numbers an archive is damaged.
inline constexpr int kMostArchiveZoom = 30;

/// "archive-unreadable", with why.
inline proto::Problem unreadable(const std::string& path, const std::string& why) {
  return {"archive-unreadable", path + " cannot be read: " + why, "a complete, undamaged archive of tiles", "path"};
}

class ArchiveReader {
 public:
  using Take = std::function<void(const SquareAddress& at, std::string_view bytes)>;

  virtual ~ArchiveReader() = default;
  /// What it says of itself, with MBTiles' names: of text are "name", "format" ("png", "pbf") and "bounds"
  /// ("west,south,east,north").
  virtual const Json& metadata() const = 0;
  /// Every tile, not compressed beyond its own format. Memory does not grow with the archive.
  virtual void each_tile(const Take& take) = 0;
};

std::unique_ptr<ArchiveReader> open_pmtiles(const std::string& path);
/// stop: ends what is read, with StoreError, also within a row: it may be one that a view computes. May be null.
std::unique_ptr<ArchiveReader> open_mbtiles(const std::string& path, const std::atomic<bool>* stop);

}  // namespace cordillera::pipeline::exports
