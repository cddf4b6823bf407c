#pragma once
// What points of .glb tiles are rounded to. Draco keeps 23 bits of a coordinate, so a step that leaves room for any height is
// several millimetres, and a wall of 80 m between two samples 60 cm apart would lean by half a metre. So a dataset's middle
// height has the finest step, and it doubles with the distance from there. Beside a pole, where columns are closer than any step,
// it halves with the distance from the pole: what is so near to a point can be told from there as finely. Only the level and a
// point's own place decide, so tiles that share a point round it in one way.
#include <cmath>

#include "proto/ellipsoid.h"

namespace cordillera::gpu {

/// value rounded to the nearest multiple of step (a power of two), ties to even. |value / step| < 2^51.
CORDILLERA_HD inline double round_to(double value, double step) {
  constexpr double kShift = 0x1.8p52;
  const double shifted = value / step + kShift;
  return (shifted - kShift) * step;
}
CORDILLERA_HD inline proto::Vec3 round_to(proto::Vec3 p, double step) {
  return {round_to(p.x, step), round_to(p.y, step), round_to(p.z, step)};
}

/// Of a level, metres. Steps are powers of two.
struct EcefSteps {
  double finest_m = 0;    ///< of points no farther than near_m from the middle height; twice that to 2 near_m, and so on
  double coarsest_m = 0;  ///< and of all others
  double middle_m = 0;    ///< a height above the ellipsoid
  double near_m = INFINITY;
  double near_pole_m = 0;  ///< half of finest_m of points nearer to a pole at the middle height, a quarter to half of that, and
                           ///< so on to a 64th of coarsest_m

  EcefSteps() = default;
  /// One step at all heights.
  EcefSteps(double step_m) : finest_m(step_m), coarsest_m(step_m) {}  // NOLINT(google-explicit-constructor): they are such steps
  EcefSteps(double finest, double coarsest, double middle, double near, double near_pole = 0)
      : finest_m(finest), coarsest_m(coarsest), middle_m(middle), near_m(near), near_pole_m(near_pole) {}

  /// The greatest step of points between two heights, wherever they are.
  CORDILLERA_HD double between(double low_m, double high_m) const {
    const double above = high_m - middle_m, below = middle_m - low_m, apart = above > below ? above : below;
    double step = finest_m;
    for (double reach = near_m; apart > reach && step < coarsest_m; reach *= 2) step *= 2;
    return step;
  }
  /// The step of a point at that height.
  CORDILLERA_HD double at(const proto::Vec3& p, double height_m) const {
    const double upright = (p.z < 0 ? -p.z : p.z) - (proto::kSemiMinor_m + middle_m),
                 apart2 = p.x * p.x + p.y * p.y + upright * upright, least = coarsest_m / kFinerAtPole;
    double step = finest_m;
    for (double reach = near_pole_m; apart2 < reach * reach && step / 2 >= least; reach /= 2) step /= 2;
    return step < finest_m ? step : between(height_m, height_m);
  }
  CORDILLERA_HD proto::Vec3 rounded(const proto::Vec3& p, double height_m) const { return round_to(p, at(p, height_m)); }

 private:
  static constexpr int kFinerAtPole = 64;  // a tile may span 2^23 of the coarsest steps, and Draco fails at 2^30 of the smallest
};

}  // namespace cordillera::gpu
