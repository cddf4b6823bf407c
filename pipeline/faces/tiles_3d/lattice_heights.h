#pragma once
// Heights at vertices of the lattice, as the meshes of a level have them: samples of the surface that clients see.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/faces/terrain.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// A rectangle of vertices, every step-th one. Columns count on across the antimeridian in either direction; rows beyond a pole have no height.
struct LatticeWindow {
  std::int64_t west = 0, north = 0;  ///< column and row of its first vertex, finest units
  std::int64_t step = 1;             ///< finest units
  std::int32_t columns = 0, rows = 0;
  std::vector<double> height_m;                    ///< by row from the north, then column; above the ellipsoid, not a number where there is none
  std::vector<proto::RowFrame> row_frames{};       ///< indexed by row
  std::vector<proto::ColumnFrame> column_frames{};  ///< indexed by column

  double at(std::int32_t row, std::int32_t column) const {
    return height_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
  }
};

/// Fills in heights and frames. A vertex has the same bits whichever window it is in.
void draw_lattice(const Terrain& terrain, int level, LatticeWindow& window);

}  // namespace cordillera::pipeline::faces
