#pragma once
// The part of a tile mesh that clients get to see, made a manifold.
#include <array>
#include <cstdint>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::pipeline {

using Triangle = std::array<std::uint32_t, 3>;

/// Triangles without a void corner. Where only a corner joins two fans of them (two rims touch in one point), each fan has a
/// vertex of its own: the encoders see a manifold and clients need no special case.
struct PublishedMesh {
  std::vector<std::uint32_t> source;                   ///< indexed by published vertex: its vertex in the tile mesh
  std::vector<Triangle> triangles;                     ///< published vertices, counter-clockwise seen from above
  std::vector<std::array<std::uint32_t, 2>> boundary;  ///< directed edges with one triangle, which lies to their left

  bool empty() const { return triangles.empty(); }
};

/// left_out: indexed by triangle of the mesh, 1 where it is not to be seen either; empty: none.
PublishedMesh published_mesh(const proto::TileMesh& mesh, const std::vector<std::uint8_t>& left_out = {});

}  // namespace cordillera::pipeline
