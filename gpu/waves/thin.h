#pragma once
// Thinning: vertices go out of a simplified mesh where the promise holds without them.
//
// The waves judge a collapse by what it can see; here it is judged by the true error of the triangles that it makes, and the
// collapse that does least harm goes first (W. Schroeder, J. Zarge, W. Lorensen, "Decimation of triangle meshes", 1992, with the
// error bound of J. Cohen et al., "Simplification envelopes", 1996). What the waves left for want of sight, and what refinement
// put in next to vertices that it made superfluous, goes.
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

struct Thinning {
  double limit_m = 0;  ///< no new triangle may exceed it
  int height_rounds =
      0;  ///< after the first round: heights move where that lessens the greatest error around, and what then may go goes
  std::int32_t height_step = 1;  ///< by multiples of it
};

/// Collapses inner vertices with data all around onto a neighbour. Returns how many went. Vertices marked kKeep, those on the
/// tile's border and rims stay as they are. Keeps the laws of a tile, as refine does; triangles that it does not touch may exceed
/// the limit.
std::uint32_t thin(proto::TileMesh& mesh, const ErrorMeter& meter, const Thinning& how);

}  // namespace cordillera::gpu
