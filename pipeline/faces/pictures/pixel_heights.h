#pragma once
// Heights above the geoid at the pixels of a WebMercatorQuad tile: what every raster face is coloured from.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/faces/face.h"
#include "pipeline/faces/map_window.h"
#include "proto/result.h"

namespace cordillera::pipeline::faces {

/// Pixels of the surroundings that a grid holds on each side of its tile, for slopes.
inline constexpr std::int32_t kMargin = 1;

struct PixelHeights {
  int level = 0;                 ///< of the meshes
  std::size_t side = 0;          ///< pixels, margins included
  std::vector<double> height_m;  ///< by row from the north, then column; above the geoid, not a number where there is none
  std::vector<float> water{};    ///< in the same order, how much of a pixel is water, 0 to 1; empty: nobody says
  bool data = false;             ///< any pixel of the tile itself has something to show

  /// The pixel of the tile's row and column; -1 and 256 are margins.
  double at(std::int32_t row, std::int32_t column) const { return height_m[index(row, column)]; }
  double water_at(std::int32_t row, std::int32_t column) const { return water.empty() ? 0 : water[index(row, column)]; }

 private:
  std::size_t index(std::int32_t row, std::int32_t column) const {
    return static_cast<std::size_t>(row + kMargin) * side + static_cast<std::size_t>(column + kMargin);
  }
};

/// Heights at pixel centres, as the meshes have them; water of a known height has that (see water_pixels.h). Nothing where the
/// tile is beyond the dataset's zooms or does not touch the bounds that its TileJSON states. A problem without a geoid.
proto::Result<std::optional<PixelHeights>> pixel_heights(const Terrain& terrain, const Place& place);

/// What a picture can do where there is no data.
enum class Beyond : std::uint8_t {
  clear,  ///< transparent outside the outline
  faded,  ///< a height everywhere, which goes down to the geoid outside
};
/// The same without holes: `outline_fill.h` has how. data: any pixel of the tile has a height other than that of the geoid, or
/// data.
proto::Result<std::optional<PixelHeights>> filled_grid(const Terrain& terrain, const Place& place, Beyond beyond);
/// The same for any window: its heights are drawn and filled. A pixel's height is a function of its place and the window's level
/// alone.
proto::Result<void> filled_window(const Terrain& terrain, MapWindow& window, Beyond beyond);

}  // namespace cordillera::pipeline::faces
