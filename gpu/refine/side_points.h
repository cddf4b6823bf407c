#pragma once
// Points of a tile's sides. Refinement alone includes it.
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

inline bool is_on_side(const proto::TileMesh& mesh, const MeshPoint& p) {
  return p.x == 0 || p.y == 0 || p.x == mesh.side || p.y == mesh.side;
}
inline bool lie_on_a_side(const proto::TileMesh& mesh, const MeshPoint& a, const MeshPoint& b) {
  return (a.x == b.x && (a.x == 0 || a.x == mesh.side)) || (a.y == b.y && (a.y == 0 || a.y == mesh.side));
}
/// Is p, on the line of a and b, between them?
inline bool is_between(const MeshPoint& p, const MeshPoint& a, const MeshPoint& b) {
  return (a.x - p.x) * (b.x - p.x) + (a.y - p.y) * (b.y - p.y) < 0;
}

}  // namespace cordillera::gpu
