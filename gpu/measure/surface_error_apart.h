#pragma once
// How far the two decodings of a triangle are apart: where that is known, one of them need not be measured wherever the other one
// is good.
#include <cmath>

#include "gpu/measure/surface_error_triangle.h"

namespace cordillera::gpu {

/// No sample in the closed plan of t is farther from its rounded decoding than from the exact one by more than this. Infinite
/// where a plane is too steep for a bound.
///
/// Let n be the ellipsoid's normal at a sample, N.X = N.A the exact plane, N'.X = N'.A' the rounded one, X where the normal meets
/// the exact one. The rounded one is met (N' - N).(X - A) + N'.(A - A') farther along, divided by N'.n. Normals turn over the
/// triangle's plan by no more than its columns and rows do, and X - A, in the plane, is as long as its part across n divided by
/// the cosine between n and N.
CORDILLERA_HD inline double decodings_apart_m(const MeasuredTriangle& t, double unit_rad) {
  constexpr double kLargestRadius_m = 6.5e6;  // of curvature, heights included
  constexpr double kLevel_rad = 1e-4;         // between n and the gradient below, at any height allowed
  constexpr double kLeastRise = 1.0 / 32;     // sine of a plane's steepness
  constexpr double kRounding_m = 1e-6;        // of heights of a level plane; they grow as it gets steeper
  constexpr double kPolar2 = (1 - proto::kFlattening) * (1 - proto::kFlattening);
  using proto::dot;
  const double turn_rad =
      static_cast<double>(t.plan.columns.last - t.plan.columns.first + t.plan.rows.last - t.plan.rows.first) * unit_rad;
  const proto::Vec3& a = t.exact_corner[0];
  const proto::Vec3 up{a.x, a.y, a.z / kPolar2}, &n = t.exact.normal, &r = t.rounded.normal;
  const double up2 = dot(up, up), n2 = dot(n, n), r2 = dot(r, r);
  const auto magnitude = [](double d) { return d < 0 ? -d : d; };
  const auto least_rise = [&](const proto::Vec3& normal, double normal2) {
    return magnitude(dot(normal, up)) / sqrt(normal2 * up2) - turn_rad - kLevel_rad;
  };
  const double rise = least_rise(n, n2), rounded_rise = least_rise(r, r2);
  if (!(rise > kLeastRise && rounded_rise > kLeastRise)) return INFINITY;  // also those that are no planes
  const proto::Vec3 tilt = r - n;
  const double across_m = turn_rad * kLargestRadius_m / rise;
  const double moved_m =
      (sqrt(dot(tilt, tilt)) * across_m + magnitude(dot(r, a - t.rounded_corner[0]))) / (sqrt(r2) * rounded_rise);
  const double clamped_m = detail::most(magnitude(t.exact_range.low_m - t.rounded_range.low_m),
                                        magnitude(t.exact_range.high_m - t.rounded_range.high_m));
  return moved_m + clamped_m + kRounding_m / detail::least(rise, rounded_rise);
}

}  // namespace cordillera::gpu
