#pragma once
// How steep the ground is at the pixels of a height grid.
#include <cstdint>

#include "pipeline/faces/pictures/pixel_heights.h"

namespace cordillera::pipeline::faces {

/// Ground size of a pixel, metres. The grid is conformal on a sphere, so on the ellipsoid the two differ by up to 0.7 %.
struct PixelSize {
  double east_m = 0, south_m = 0;
};
/// The size of the pixels in a tile's row, 0 to 255. It depends on the row alone, so tiles beside each other agree.
PixelSize pixel_size(const Place& place, std::int32_t row);

/// Metres of rise a metre.
struct Gradient {
  double east = 0, north = 0;
};
/// By the method of Horn (1981), doi:10.1109/PROC.1981.11918, as gdaldem has it: from the eight pixels around, those beyond the
/// tile's side included. Where a neighbour has no data the pixel's own height stands for it. The pixel itself must have data.
Gradient gradient(const PixelHeights& grid, std::int32_t row, std::int32_t column, const PixelSize& size);

}  // namespace cordillera::pipeline::faces
