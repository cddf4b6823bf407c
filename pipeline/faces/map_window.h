#pragma once
// A rectangle of pixels of one WebMercatorQuad zoom, wherever it lies, with a height at each centre.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/result.h"

namespace cordillera::pipeline::faces {

class Terrain;

/// Columns count on across the antimeridian, in either direction, by less than a turn; rows count on beyond the grid's ends.
struct MapWindow {
  int zoom = 0;
  int level = 0;                     ///< of the meshes that it is drawn from
  std::int64_t west = 0, north = 0;  ///< its first column and row; at whole numbers of 256 a tile begins
  std::int32_t columns = 0, rows = 0;
  std::vector<double> height_m;  ///< by row, then column; above the geoid, not a number where there is none

  std::size_t index(std::int64_t column, std::int64_t row) const {
    return static_cast<std::size_t>((row - north) * columns + (column - west));
  }
  double at(std::int64_t column, std::int64_t row) const { return height_m[index(column, row)]; }
};

/// Replaces the heights by those of the flat triangles over the pixels' centres. A problem without a geoid.
proto::Result<void> draw_heights(const Terrain& terrain, MapWindow& window);

}  // namespace cordillera::pipeline::faces
