// The two decodings of a triangle are nowhere farther apart than their bound, and the bound is worth having.
#include "gpu/measure/surface_error_apart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "gpu/measure/surface_meter.h"
#include "tests/gpu/measured_tile.h"

namespace cordillera::gpu {
namespace {

double off_m(const Plane& plane, const HeightRange& range, const proto::RowFrame& row, const proto::ColumnFrame& column,
             double height_m) {
  return std::abs(range.clamp(PlaneRow(plane, row).height_m(column.sin_lon, column.cos_lon)) - height_m);
}

struct Found {
  double bound_m = 0, greatest_m = 0;  ///< how far apart the errors of samples really are
};

Found found(const SurfaceMeter& meter, const SampleFrames& frames, const proto::Samples& samples,
            const std::array<MeshPoint, 3>& c) {
  const auto corner = [&](std::size_t k) { return meter.corner(c[k].x, c[k].y, c[k].height); };
  const MeasuredTriangle t = meter.triangle({corner(0), corner(1), corner(2)}, 0);
  Found f{decodings_apart_m(t, M_PI / static_cast<double>(kLattice.rows())), 0};
  for (std::int64_t y = t.plan.rows.first; y <= t.plan.rows.last; ++y) {
    const Span closed = t.plan.row(y).closed;
    for (std::int64_t x = closed.first; x <= closed.last; ++x) {
      const auto at = static_cast<std::size_t>(y * (kSide + 1) + x);
      const proto::RowFrame& row = frames.rows[static_cast<std::size_t>(y)];
      const proto::ColumnFrame column = frames.column(static_cast<std::size_t>(x));
      const double height_m = samples.height[at] * proto::kHeightStep_m;
      f.greatest_m = std::max(f.greatest_m, std::abs(off_m(t.exact, t.exact_range, row, column, height_m) -
                                                     off_m(t.rounded, t.rounded_range, row, column, height_m)));
    }
  }
  return f;
}

/// Triangles whose corners are no farther from each other than `reach`; of hills, or with heights of their own.
void expect_bounded(double step_m, std::int32_t reach, std::int32_t relief, double worth) {
  const proto::Samples samples = samples_of(kHills);
  const TileMesh grid = coarse(samples, 4);
  SurfaceErrorInput in = input_of(grid, samples);
  const SampleFrames frames(kLattice, samples);
  in.ecef_steps = step_m;
  in.frames = &frames;
  const SurfaceMeter meter(in, {-16000, 16000});
  std::mt19937 random(5);
  std::uniform_int_distribution<std::int32_t> place(0, kSide), beside(-reach, reach), height(-relief, relief);
  int bounded = 0, useful = 0, measured = 0;
  while (measured < 3000) {
    std::array<MeshPoint, 3> c;
    c[0] = {place(random), place(random), 300 * 1024 + height(random)};
    for (std::size_t k = 1; k < 3; ++k)
      c[k] = {std::clamp(c[0].x + beside(random), 0, kSide), std::clamp(c[0].y + beside(random), 0, kSide),
              300 * 1024 + height(random)};
    if (twice_area(c[0], c[1], c[2]) <= 0) continue;
    ++measured;
    const Found f = found(meter, frames, samples, c);
    EXPECT_LE(f.greatest_m, f.bound_m) << c[0].x << " " << c[0].y << ", " << c[1].x << " " << c[1].y << ", " << c[2].x << " "
                                       << c[2].y;
    bounded += std::isfinite(f.bound_m) ? 1 : 0;
    useful += f.bound_m < 10 * step_m ? 1 : 0;
  }
  EXPECT_GE(bounded, worth * measured);
  EXPECT_GE(useful, 0.6 * worth * measured);
}

TEST(surface_error_apart, bounds_triangles_of_any_shape) {
  for (const double step_m : {1.0 / 256, 1.0 / 4, 4.0}) {
    SCOPED_TRACE(step_m);
    expect_bounded(step_m, 8, 20 * 1024, 0.8);
    expect_bounded(step_m, 60, 100 * 1024, 0.8);
    expect_bounded(step_m, kSide, 400 * 1024, 0.8);
  }
}
TEST(surface_error_apart, bounds_steep_ones) { expect_bounded(1.0 / 16, 20, 9000 * 1024, 0); }

TEST(surface_error_apart, knows_nothing_of_what_is_no_plane) {
  MeasuredTriangle none;
  EXPECT_EQ(decodings_apart_m(none, 1e-6), INFINITY);
}

}  // namespace
}  // namespace cordillera::gpu
