#pragma once
// Takes out the border vertices that waves of collapses could not: a sequential pass over what is left, which is little.
#include <cmath>
#include <cstdint>

#include "gpu/mesh/rings.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// caps: valences that the mend keeps to (void vertices: see rings.h); a vertex that is above its cap already may only fall.
/// Removes from rings the vertices that mesh marks kRemove, those on the sides of the tile first the finest positions, by a
/// collapse along the border or, where that is blocked, by other triangles for their star; where valences block that too, edges
/// near it are flipped and inner vertices (not kKeep) removed, those first whose removal moves no rim. Only as a last resort do
/// inner valences rise to kMostValence. rim_units: how far rims may move on the way, seen as the area that is published more or
/// less. mesh gives positions and marks, indexed as rings; its triangles are not read. Returns how many such vertices are left.
std::uint32_t mend(Rings& rings, const proto::TileMesh& mesh, const ValenceCaps& caps, float rim_units = INFINITY);

}  // namespace cordillera::gpu
