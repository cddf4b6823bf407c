#pragma once
// What points of .glb tiles are rounded to. Draco keeps 23 bits of a coordinate, so steps that leave room for any height are
// several millimetres, and a wall of 80 m between two samples 60 cm apart would lean by half a metre. Near the dataset's usual
// heights steps are finer. Only the level and a point's own height decide, so tiles that share a point round it in one way.
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

/// Of a level, metres. Steps are powers of two, and far_m is no less than near_m.
struct EcefSteps {
  double near_m = 0;                            ///< of points whose heights are low_m to high_m
  double far_m = 0;                             ///< of all others
  double low_m = -INFINITY, high_m = INFINITY;  ///< above the ellipsoid

  EcefSteps() = default;
  /// One step at all heights.
  EcefSteps(double step_m) : near_m(step_m), far_m(step_m) {}  // NOLINT(google-explicit-constructor): a step is such steps
  EcefSteps(double near_step_m, double far_step_m, double low, double high)
      : near_m(near_step_m), far_m(far_step_m), low_m(low), high_m(high) {}

  /// The greatest step of points between two heights.
  CORDILLERA_HD double between(double lowest_m, double highest_m) const {
    return lowest_m >= low_m && highest_m <= high_m ? near_m : far_m;
  }
  CORDILLERA_HD proto::Vec3 rounded(const proto::Vec3& p, double height_m) const {
    return round_to(p, between(height_m, height_m));
  }
};

}  // namespace cordillera::gpu
