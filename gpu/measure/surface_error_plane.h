#pragma once
// One triangle in space: its plane, as a client decodes it, and the height of that plane over a lattice sample.
//
// With N the plane's normal, A a corner, n the ellipsoid's normal at a sample and P0 its foot on the ellipsoid, the flat triangle
// stands (N.A - N.P0) / (N.n) above the ellipsoid there. Row and column frames leave nine flops and one division of it.
#include <cstdint>

#include "proto/ellipsoid.h"
#include "proto/host_device.h"

namespace cordillera::gpu {

/// No radius of curvature of a surface at a height allowed is smaller (the least of the ellipsoid is 6335.4 km).
inline constexpr double kLeastRadius_m = 6.3e6;
/// Errors beyond this count as this in the sum of squares, so that a square fits 63 bits.
inline constexpr double kLargestSummed_m = 0x1p21;
/// The sum of squares is kept in integers: its value then never depends on the order of the summands.
inline constexpr double kSquaresPerStep = 0x1p20;

/// The plane { X : normal.X = offset }; not normalised.
struct Plane {
  proto::Vec3 normal;
  double offset = 0;
  /// False for a triangle without area (at a pole, or rounded to a line): a ray meets only what its neighbours show too.
  CORDILLERA_HD bool shows() const { return proto::dot(normal, normal) > 0; }
};

CORDILLERA_HD inline Plane plane_of(const proto::Vec3& a, const proto::Vec3& b, const proto::Vec3& c) {
  const proto::Vec3 n = proto::cross(b - a, c - a);
  return {n, proto::dot(n, a)};
}

/// A plane along one lattice row: what does not change from column to column.
struct PlaneRow {
  double normal_x = 0, normal_y = 0;
  double above_m = 0, radius_m = 0;  ///< numerator: above - radius * q
  double rise = 0, cos_lat = 0;      ///< denominator: rise + cos_lat * q

  CORDILLERA_HD PlaneRow(const Plane& plane, const proto::RowFrame& row)
      : normal_x(plane.normal.x),
        normal_y(plane.normal.y),
        above_m(plane.offset - plane.normal.z * row.axis_m),
        radius_m(row.radius_m),
        rise(plane.normal.z * row.sin_lat),
        cos_lat(row.cos_lat) {}

  /// Ellipsoidal height of the plane over a column; infinite or not a number where the plane stands upright.
  CORDILLERA_HD double height_m(double sin_lon, double cos_lon) const {
    const double q = normal_x * cos_lon + normal_y * sin_lon;
    return (above_m - radius_m * q) / (rise + cos_lat * q);
  }
};

/// Does the line through foot along up meet the triangle, or pass it by less than a millimetre? edge_m: its longest edge. From
/// either side: a sliver that runs east and west is narrower than its chords' bulge, and roundings alone may turn it over.
CORDILLERA_HD inline bool meets(const proto::Vec3& foot, const proto::Vec3& up, const proto::Vec3 (&corner)[3], double edge_m) {
  const proto::Vec3 a = corner[0] - foot, b = corner[1] - foot, c = corner[2] - foot;
  const double grace = 1e-3 * edge_m;
  const double ab = proto::dot(up, proto::cross(a, b)), bc = proto::dot(up, proto::cross(b, c)),
               ca = proto::dot(up, proto::cross(c, a));
  return (ab >= -grace && bc >= -grace && ca >= -grace) || (ab <= grace && bc <= grace && ca <= grace);
}

/// Heights that no point of the flat triangle can leave. The top: height over a convex body is a convex function. The bottom: the
/// ball of kLeastRadius_m that touches the body from inside leaves out every corner, so (R - d)^2 >= R^2 - (longest edge)^2 / 3
/// for a point of the triangle at depth d. Clamping to it tames planes that roundings tilted, and extrapolation beyond an edge.
struct HeightRange {
  double low_m = 0, high_m = 0;
  CORDILLERA_HD double clamp(double height_m) const {
    const double raised = height_m > low_m ? height_m : low_m;  // not a number becomes low_m
    return raised < high_m ? raised : high_m;
  }
};

/// low_m, high_m: extremes of the corners' heights; edge2_m2: square of the longest edge; step_m: what rounding may have moved.
CORDILLERA_HD inline HeightRange height_range(double low_m, double high_m, double edge2_m2, double step_m) {
  return {low_m - edge2_m2 / (3 * kLeastRadius_m) - step_m, high_m + step_m};
}

/// error^2 in steps of 1 / kSquaresPerStep.
CORDILLERA_HD inline std::uint64_t square_steps(double error_m) {
  const double e = error_m < kLargestSummed_m ? error_m : kLargestSummed_m;
  return static_cast<std::uint64_t>(
      static_cast<std::int64_t>(e * e * kSquaresPerStep + 0.5));  // NOLINT(bugprone-incorrect-roundings): never negative
}

/// Up to 2^32 squares, in any order, with integer additions only.
struct SquareSum {
  std::uint64_t low = 0, high = 0;  ///< value = high * 2^32 + low
  CORDILLERA_HD void add(std::uint64_t steps) {
    low += steps & 0xffffffffu;
    high += steps >> 32;
  }
  CORDILLERA_HD double value_m2() const {
    // Whatever was added together before it came here: the carry decides what is rounded.
    return (static_cast<double>(high + (low >> 32)) * 0x1p32 + static_cast<double>(low & 0xffffffffu)) / kSquaresPerStep;
  }
};

}  // namespace cordillera::gpu
