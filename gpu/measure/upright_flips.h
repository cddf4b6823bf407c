#pragma once
// Where a triangle shows its back in space and no vertex helps, for it is a needle between vertices that are neighbours on the
// lattice: edges are turned, vertices collapsed, and what is left along a rim is left out.
#include "gpu/measure/upright.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// Turns edges inside the tile, as long as both triangles then are upright, no farther off than limit_m, and published as they
/// were. What no edge helps loses a vertex that has data all around, which then is in no triangle. Labels, border and valences
/// stay what a tile may have. Where the mesh has published triangles alone, what is left goes, if it ends at a rim. limit_m:
/// INFINITY where errors are for refinement to mend. How many steps that took.
std::uint32_t flip_turned(proto::TileMesh& mesh, const Upright& upright, const ErrorMeter& meter, double limit_m);

}  // namespace cordillera::gpu
