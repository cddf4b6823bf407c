#pragma once
// What every face of raster tiles does the same way, whatever its pixels mean.
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/faces/face.h"
#include "pipeline/faces/pictures/pixel_heights.h"

namespace cordillera::pipeline::faces {

/// How heights become a picture.
struct RasterStyle {
  std::string_view path;  ///< of the tiles, with z, x and y in braces
  /// By row from the north, then column.
  std::vector<std::uint8_t> (*pixels)(const Terrain& terrain, const PixelHeights& grid, const Place& place) = nullptr;
  std::string (*encode)(const std::vector<std::uint8_t>& pixels) = nullptr;
  Beyond beyond = Beyond::clear;
};

/// A tile. Where it touches the dataset's bounds but has nothing to show, the picture of a grid without heights: clients ask for
/// what a TileJSON's bounds cover, and many of them complain about a refusal. Beyond the bounds and the zooms nothing exists.
proto::Result<std::optional<Document>> raster_tile(const Terrain& terrain, const Place& place, const RasterStyle& style);

/// Tiles of the dataset's zooms that show something, from coarse to fine. path_of: of a tile under which there are meshes, or
/// what is filled in where there are none; nothing where it shows nothing. Called by the sink's threads.
void each_shown_tile(const Terrain& terrain, Beyond beyond, const PathSink& sink,
                     const std::function<std::optional<std::string>(const Place&)>& path_of);

/// Paths of the tiles that have something to show.
void each_raster_tile(const Terrain& terrain, const RasterStyle& style, const PathSink& sink);

}  // namespace cordillera::pipeline::faces
