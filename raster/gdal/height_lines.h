#pragma once
// Lines of equal height through a grid of heights, by GDAL's contour generator (marching squares).
#include <cstdint>
#include <limits>
#include <vector>

namespace cordillera::raster {

inline constexpr std::int32_t kNoHeightHere = std::numeric_limits<std::int32_t>::min();

/// Heights in whole steps. Whole numbers make every interpolation the same bits wherever in a grid its four heights stand, so
/// that two grids with a common part have the same lines there.
struct HeightSteps {
  std::int32_t columns = 0, rows = 0;
  std::vector<std::int32_t> height;  ///< by row, then column; kNoHeightHere where there is none
};

/// Places count columns and rows; the first height stands at 0, 0.
struct GridPlace {
  double column = 0, row = 0;
};
struct HeightLine {
  std::int32_t height = 0;        ///< steps
  std::vector<GridPlace> places;  ///< two at least; a ring ends where it begins
};

/// Lines at all multiples of an interval, one or more steps. A height that is a multiple itself counts as above it. Around the
/// grid, and around heights that are missing, a line ends within half a cell. The order is that of heights, then GDAL's. Throws
/// std::runtime_error where GDAL fails, which it has no reason to.
std::vector<HeightLine> height_lines(const HeightSteps& grid, std::int32_t interval);

}  // namespace cordillera::raster
