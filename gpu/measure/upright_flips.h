#pragma once
// Where a triangle shows its back in space and no vertex helps, for it is a needle between vertices that are neighbours on the lattice: edges are
// turned, vertices collapsed, and what is left along a rim is left out.
#include "gpu/measure/upright.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// Turns edges inside the tile, as long as both triangles then are upright, no farther off than limit_m, and of the kind (published or not) that they
/// were. Labels, border and valences stay what a tile may have. Where the mesh has published triangles alone, what no edge helps loses a vertex, which then
/// is in no triangle, or goes, if it ends at a rim. How many steps that took.
std::uint32_t flip_turned(proto::TileMesh& mesh, const Upright& upright, const ErrorMeter& meter, double limit_m);

}  // namespace cordillera::gpu
