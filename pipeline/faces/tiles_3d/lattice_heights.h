#pragma once
// Heights at even places, as the meshes of a level have them: samples of the surface that clients see.
#include <cstddef>
#include <cstdint>
#include <vector>

#include "pipeline/faces/terrain.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// A rectangle of places of a lattice twice as fine as the dataset's, every step-th one. Columns count on across the antimeridian
/// in either direction; rows beyond a pole have no height.
struct LatticeWindow {
  std::int64_t west = 0, north = 0;  ///< column and row of its first place, halves of the finest unit
  std::int64_t step = 1;             ///< halves, too
  std::int32_t columns = 0, rows = 0;
  std::vector<double> height_m;  ///< by row from the north, then column; above the ellipsoid, not a number where there is none
  std::vector<proto::RowFrame> row_frames{};        ///< indexed by row
  std::vector<proto::ColumnFrame> column_frames{};  ///< indexed by column

  double at(std::int32_t row, std::int32_t column) const {
    return height_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
  }
};

/// What a window's places are counted in.
inline proto::Lattice half_lattice(const Terrain& terrain) { return {terrain.lattice().finest_level + 1}; }

/// Fills in heights and frames. A place has the same bits whichever window it is in.
void draw_lattice(const Terrain& terrain, int level, LatticeWindow& window);

}  // namespace cordillera::pipeline::faces
