#pragma once
// A meter's glance against what it measures in full.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// Random triangles of a tile, each asked for at limits around its error.
inline void expect_glance_agrees(const ErrorMeter& meter, std::int32_t side, std::int32_t low, std::int32_t high) {
  std::mt19937 random(11);
  std::uniform_int_distribution<std::int32_t> place(0, side), height(low, high);
  int measured = 0;
  for (int n = 0; n < 400; ++n) {
    std::array<MeshPoint, 3> c;
    for (MeshPoint& p : c) p = {place(random), place(random), height(random)};
    if (twice_area(c[0], c[1], c[2]) <= 0) continue;
    const double whole_m = meter.measure(c, INFINITY).error_m;
    EXPECT_EQ(meter.error_m(c, INFINITY), whole_m);
    EXPECT_EQ(meter.error_m(c, whole_m), whole_m);
    EXPECT_EQ(meter.error_m(c, 2 * whole_m), whole_m);
    EXPECT_EQ(meter.error_m(c, {whole_m, -1, place(random)}), whole_m) << "whichever row is looked at first";
    EXPECT_EQ(meter.error_m(c, {INFINITY, 0.99 * whole_m}), whole_m);
    EXPECT_LE(meter.error_m(c, {INFINITY, whole_m, place(random)}), whole_m);
    EXPECT_LE(meter.error_m(c, {whole_m, 1.5 * whole_m}), 1.5 * whole_m);
    if (whole_m <= 0) continue;
    EXPECT_GT(meter.error_m(c, whole_m / 2), whole_m / 2);
    EXPECT_GT(meter.error_m(c, {whole_m / 2, whole_m / 2, place(random)}), whole_m / 2);
    EXPECT_GT(meter.error_m(c, 0), 0);
    ++measured;
  }
  EXPECT_GT(measured, 100);
}

}  // namespace cordillera::gpu
