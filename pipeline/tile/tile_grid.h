#pragma once
// The regular mesh of a tile's samples, with sides that are given: what a published algorithm begins with.
#include <vector>

#include "pipeline/tile/tile_mesh.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Of the rectangle that a block's tile covers, void triangles included: the samples at every step-th row and column, a power of
/// two, each with six triangles; fewer between them where the rectangle is narrow. But on the sides there are the tile's own
/// vertices alone, kKeep, and rows beside them become as even as the others from one to the next. Vertices without data are
/// kVoid. samples: hold the rectangle.
proto::TileMesh tile_grid(const proto::Lattice& lattice, const BuiltTile& tile, const proto::Samples& samples, std::int64_t step);

/// Metres, by vertex: heights minus the sag of the ellipsoid relative to the tile's centre, so that a flat sea costs what its
/// curvature costs. Second order is enough: it steers collapses only; errors are measured exactly.
std::vector<float> elevations(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh);

}  // namespace cordillera::pipeline
