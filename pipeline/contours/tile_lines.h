#pragma once
// Contours as a vector tile holds them: whole numbers, of which the tile's side has kExtent.
#include <cstdint>
#include <vector>

#include "raster/gdal/height_lines.h"

namespace cordillera::pipeline::contours {

inline constexpr std::int32_t kExtent = 4096;
/// Lines go on so far beyond the tile's sides, so that a renderer's thick lines and their joins are whole at a side.
inline constexpr std::int32_t kBuffer = 64;

/// From the tile's north-western corner, x to the east, y to the south.
struct TilePoint {
  std::int32_t x = 0, y = 0;
  friend auto operator<=>(const TilePoint&, const TilePoint&) = default;
};
using TileLine = std::vector<TilePoint>;

/// All lines of one height.
struct Contour {
  std::int32_t height_mm = 0;
  std::vector<TileLine> lines;  ///< two points at least each, consecutive ones differ; a ring ends where it begins
};

/// From lines through a grid whose margin is `reach` pixels. Places are rounded to a unit, a sixteenth of a pixel. Points are
/// left out where a line stays within a unit of where it was; those at a side, and beyond it, all stay: what crosses a side is
/// the same segment in both of its tiles. Contours that only lie in the buffer are left out. By height.
std::vector<Contour> tile_lines(const std::vector<raster::HeightLine>& lines, std::int32_t reach);

/// Douglas and Peucker (1973), in whole numbers: points are left out of which none is farther than a unit from the straight line
/// over it. Points within half a pixel of the tile's sides, and beyond, stay.
TileLine simplified(const TileLine& line);

/// Parts of a line within the square from -margin to kExtent + margin. Ends are rounded to a unit.
std::vector<TileLine> clipped(const TileLine& line, std::int32_t margin);

}  // namespace cordillera::pipeline::contours
