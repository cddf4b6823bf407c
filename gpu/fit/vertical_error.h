#pragma once
// How far a surface is from points above or below it, along z. In plain double precision and with no part of the simplifier in
// it, so that it can judge what the simplifier says of itself.
#include <cstddef>
#include <cstdint>
#include <span>

#include "gpu/simplify.h"
#include "proto/mesh_file/triangle_mesh.h"

namespace cordillera::gpu {

/// Borrowed; three arrays of one length, finite.
struct PointsXyz {
  std::span<const double> x, y, z;
};

struct VerticalError {
  /// Over the points that were measured, in the unit of z; where sheets lie above each other, the farther counts.
  double rmse = 0, max = 0;
  std::size_t worst = 0;        ///< the point with the greatest error
  std::uint64_t measured = 0;   ///< points above or below the surface
  std::uint64_t uncovered = 0;  ///< points beside the surface: they have no error, and are in neither number
};

/// A point a millionth of the extent beside the surface is still measured, at the nearest place of it: rounding must not lose
/// points on the border. surface: triangles may be turned and folded in any way. The work is cut into shares for parallel; the
/// result does not depend on either.
VerticalError vertical_error(const proto::TriangleMesh& surface, const PointsXyz& points, std::size_t shares = 1,
                             const ParallelFor& parallel = one_after_the_other);

}  // namespace cordillera::gpu
