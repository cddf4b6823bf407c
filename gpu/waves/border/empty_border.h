#pragma once
// The last thing a strategy does to a tile: what its border chains dropped and is still there goes.
#include "gpu/mesh/rings.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// mesh: positions, heights and marks, indexed as rings; vertices may be moved (see nudge.h). What is left of both as a mesh.
proto::TileMesh with_border_emptied(Rings& rings, proto::TileMesh& mesh, float rim_units);

}  // namespace cordillera::gpu
