#pragma once
// How far from its plan triangle a flat triangle in space can be seen.
//
// The edge of a flat triangle is a chord: seen along the ellipsoid's normals it bends away from the straight lattice line between
// its ends (towards the pole by about dlon^2 / 16 sin 2lat, and along the parallel by about dlon dlat tan(lat) / 4). So a ray may
// meet the triangle at a sample outside its plan, and this is an upper bound of how far outside. Let a point of the triangle have
// barycentric weights w; its place in plan is the weighted mean of the corners' angles. With x the corners' deviations from that
// mean, sum(w x) = 0, variance <= range^2 / 4, covariance of two ranges <= product / 4, |x - sin x| <= |x|^3 / 6:
//   along the parallel   tan(du) <= (dr dlon / 4 + r dlon^3 / 24) / (r_min (1 - dlon^2 / 8)),   r: distance from the axis
//   along the meridian   (M + h) dv <= M' dlat^2 / 8 + M dlat^3 / 24 + dh dlat / 4 + r dlon^2 / 8 |sin lat|
// where the last term is the parallel's bulge: the mean of the corners comes nearer to the axis by no more than r dlon^2 / 8.

#include "proto/ellipsoid.h"
#include "proto/host_device.h"

namespace cordillera::gpu {

/// What a triangle (or a whole tile) spans.
struct TriangleExtent {
  double dlon_rad = 0, dlat_rad = 0;
  double low_m = 0, high_m = 0;                  ///< corners' heights
  double edge2_m2 = 0;                           ///< square of the longest edge
  double least_radius_m = 0, most_radius_m = 0;  ///< corners' distances from the axis; most also between the corners
  double off_pole_radius_m = 0;                  ///< least distance from the axis of the corners that are not on it
  double most_sin_lat = 0;                       ///< greatest |sin(latitude)|
  double step_m = 0;                             ///< rounding of ECEF coordinates
};

/// Upper bounds in radians.
struct Reach {
  double lon_rad = 0, lat_rad = 0;  ///< between a point's place in plan and where it is seen
  double beyond_lon_rad = 0;        ///< how far the triangle is seen beyond its corners' meridians
};

namespace detail {
inline constexpr double kAnywhere_rad = 7;  // more than the circle
CORDILLERA_HD inline double least(double a, double b) { return a < b ? a : b; }
CORDILLERA_HD inline double most(double a, double b) { return a > b ? a : b; }
}  // namespace detail

CORDILLERA_HD inline Reach reach_of(const TriangleExtent& e) {
  using namespace detail;
  constexpr double kFrame_rad = 0x1p-39;          // roundings of the row and column frames
  constexpr double kMeridianSlope_m = 65000;      // > |dM/dlat|, M the meridian's radius of curvature
  constexpr double kMeridianRadius_m = 6.42e6;    // > M + h
  constexpr double kLeastMeridian_m = 6335439.0;  // < M
  const double moved = 0.8661 * e.step_m;         // sqrt(3) / 2
  const double lon2 = e.dlon_rad * e.dlon_rad, lat2 = e.dlat_rad * e.dlat_rad;

  // Convexity keeps a ray between the corners' meridians; only rounding moves it, and a corner on the axis stays there.
  Reach reach;
  reach.beyond_lon_rad = moved < 0.5 * e.off_pole_radius_m ? 1.1 * moved / e.off_pole_radius_m + kFrame_rad : kAnywhere_rad;
  const double shrunk = e.least_radius_m * (1 - lon2 / 8) - moved;
  reach.lon_rad = e.dlon_rad + reach.beyond_lon_rad;
  if (shrunk > 0.25 * e.least_radius_m && shrunk > 0) {
    const double bend = 0.25 * (e.most_radius_m - e.least_radius_m) * e.dlon_rad + e.most_radius_m * lon2 * e.dlon_rad / 24;
    reach.lon_rad = least(reach.lon_rad, 1.001 * (bend + moved) / shrunk + kFrame_rad);
  }

  const double sag = e.edge2_m2 / (3 * 6.3e6);
  const double floor_m = 0.98 * (kLeastMeridian_m + e.low_m - sag);
  reach.lat_rad = kAnywhere_rad;
  if (floor_m > 1e6) {
    const double slide = kMeridianSlope_m * lat2 / 8 + kMeridianRadius_m * lat2 * e.dlat_rad / 24 +
                         0.25 * (e.high_m - e.low_m) * e.dlat_rad + moved;
    const double bulge = e.most_radius_m * lon2 / 8;
    const double sin_lat = least(1, e.most_sin_lat + (slide + bulge) / floor_m);
    reach.lat_rad = (slide + bulge * sin_lat) / floor_m + kFrame_rad;
  }
  return reach;
}

}  // namespace cordillera::gpu
