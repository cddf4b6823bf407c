#pragma once
// The start of a promised tile (gpu/waves/collapse/sparse_start.h) as a mesh, by another way: triangles cut in two from the
// largest down. What the simplifier's own, which makes rings without triangles, is held against.
#include <span>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::test {

struct SparseGrid {
  proto::TileMesh mesh;
  std::vector<float> elevation;  ///< indexed by vertex of mesh
};

/// grid: as grid_mesh() makes it with step 1 and a power of two of cells, marks changed since; elevation: metres, indexed by its
/// vertices. The result: right isosceles triangles that cover the grid edge to edge, over some of its vertices in their order,
/// marks and all; at most eight neighbours each. Vertices marked kKeep are there, and the corners. So is every vertex of a cell
/// that is partly void: the rest of a rim's triangles are the smallest, whichever way their cell is cut. Where data is all
/// around, a vertex is left out only if it lies within tolerance_m of the middle of the edge that then passes over it. Vertices
/// left out later than it add to that, so tolerance_m bounds no error: what comes out of the simplifier must be measured.
SparseGrid sparse_grid(const proto::TileMesh& grid, std::span<const float> elevation, float tolerance_m);

}  // namespace cordillera::test
