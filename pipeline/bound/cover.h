#pragma once
// The law of covering: what is well inside the data is shown.
#include <cstdint>
#include <vector>

#include "gpu/refine/refine.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// A closed rectangle of a tile, in its units.
struct TileRectangle {
  std::int32_t west = 0, south = 0, east = 0, north = 0;
};

/// What of the tile lies in a window of samples that begins at (west, south), on any turn of the circle; west > east: nothing.
TileRectangle part_in_window(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::Samples& window);

/// Samples of the rectangle that no published triangle covers, although all samples within `cell` columns and rows of them have
/// data. By rows from the south-west. What lies outside of `samples` has no data, so these must reach a cell beyond the
/// rectangle; but beyond a pole there is nothing that could have any.
std::vector<gpu::MeshPoint> uncovered_inside(const proto::Lattice& lattice, const proto::TileAddress& tile,
                                             const proto::TileMesh& mesh, const proto::Samples& samples,
                                             const TileRectangle& rectangle);

}  // namespace cordillera::pipeline
