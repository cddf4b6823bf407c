#pragma once
// The surface between the samples of a cell.
#include <array>
#include <cstdint>

namespace cordillera::proto {

/// A corner of a cell: steps east and north of its south-western one, and how much of a place's height is this corner's.
struct CellCorner {
  std::uint32_t east = 0, north = 0;
  double weight = 0;
};

/// The triangle of the surface between samples at a place (x, y) of a cell, both 0 to 1, counter-clockwise. Cells are cut from
/// south-west to north-east; where the cell's only void is one of these two, the other way.
inline std::array<CellCorner, 3> triangle_around(double x, double y, bool south_west_is_void, bool north_east_is_void) {
  if (x + y <= 1 && north_east_is_void) return {{{0, 0, 1 - x - y}, {1, 0, x}, {0, 1, y}}};
  if (x + y >= 1 && south_west_is_void) return {{{1, 1, x + y - 1}, {0, 1, 1 - x}, {1, 0, 1 - y}}};
  if (x >= y) return {{{0, 0, 1 - x}, {1, 0, x - y}, {1, 1, y}}};
  return {{{0, 0, 1 - y}, {1, 1, x}, {0, 1, y - x}}};
}

}  // namespace cordillera::proto
