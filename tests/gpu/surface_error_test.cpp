// The error of a tile against rays cast, sample by sample, at every triangle near it.
#include "gpu/measure/surface_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_memory.h"
#include "tests/gpu/grid_mesh.h"
#include "tests/gpu/surface_error_judge.h"

namespace cordillera::gpu {
namespace {

using proto::Samples;
using proto::TileAddress;

std::int32_t hills(std::int64_t i, std::int64_t j) {
  const double x = static_cast<double>(i), y = static_cast<double>(j);
  return static_cast<std::int32_t>(1024 * (400 * std::sin(x / 19) * std::cos(y / 23) + 30 * std::sin(x * 1.7 + y * 2.3) + 300));
}
std::int32_t sea(std::int64_t, std::int64_t) { return 0; }

void expect_same(const SurfaceError& a, const SurfaceError& b) {
  EXPECT_EQ(triangles_over(a), triangles_over(b));
  EXPECT_EQ(std::tuple(a.max_m, a.sum_squared_m2, a.samples, a.uncovered, a.overcovered),
            std::tuple(b.max_m, b.sum_squared_m2, b.samples, b.uncovered, b.overcovered));
}

/// A limit changes no other number.
void agree_over_limits(const Scene& s, const SurfaceError& e) {
  const SampleFrames frames(s.lattice, s.samples);
  SurfaceErrorInput in = s.input();
  in.frames = &frames;
  const SurfaceError all = surface_error(in, -1);
  const auto expect_over = [&](double limit_m) {
    SurfaceError expected = e;
    for (const auto& worst : all.over_limit)
      if (worst.error_m > limit_m) expected.over_limit.push_back(worst);
    expect_same(surface_error(in, limit_m), expected);
    return expected.over_limit.size();
  };
  std::size_t found = 0;
  for (const double share : {0.05, 0.5, 0.9, 0.999, 1.0}) found += expect_over(share * e.max_m);
  EXPECT_GT(found, 0u);
  // One that what roundings may add decides.
  for (std::size_t k = 0; k < all.over_limit.size(); k += 1 + all.over_limit.size() / 24)
    expect_over(all.over_limit[k].error_m * (1 - 1e-9));
}

/// A mesh that changes is measured as if it were new: where an error grows, where the greatest one goes, and back again.
void agree_in_memory(Scene s, double limit_m) {
  SurfaceMemory memory;
  const proto::TileMesh before = s.mesh;
  const auto expect_as_new = [&] {
    const SurfaceError fresh = s.measure(limit_m);
    expect_same(surface_error(s.input(), limit_m, memory), fresh);
    expect_same(surface_error(s.input(), limit_m, memory), fresh);
  };
  expect_as_new();
  const auto apart = static_cast<std::uint32_t>(s.mesh.vertices() / 3), first = apart / 2;
  for (std::uint32_t k = 0; k < 3; ++k) {
    s.mesh.height[first + k * apart] += (300 - 100 * static_cast<std::int32_t>(k)) * 1024;
    expect_as_new();
  }
  for (std::uint32_t k = 0; k < 3; ++k) {
    s.mesh.height[first + k * apart] = before.height[first + k * apart];
    expect_as_new();
  }
  s.mesh.triangles.pop_back();
  s.mesh.mark[s.mesh.triangles[9][0]] |= proto::kVoid;
  std::swap(s.mesh.triangles[3], s.mesh.triangles[6]);
  expect_as_new();
}

void agree(const Scene& s, double tight = 1.05) {
  const SurfaceError e = s.measure();
  agree_over_limits(s, e);
  for (const double limit_m : {0.6 * e.max_m, 1e9}) agree_in_memory(s, limit_m);
  const Brute b = brute(s);
  ASSERT_GT(b.hits, b.samples);
  EXPECT_GE(e.max_m, b.max_m - 2e-3);
  EXPECT_LE(e.max_m, b.max_m * tight + 2e-3);
  // Beside a triangle without area at a pole, the rule of edges may give it samples that its neighbour shows.
  const bool pole = s.south() == 0 || s.south() + s.mesh.side == s.lattice.rows();
  EXPECT_LE(e.samples, b.samples);
  EXPECT_GE(e.samples, pole ? 0.99 * b.samples : b.samples);
  EXPECT_EQ(e.uncovered, b.uncovered);
  EXPECT_EQ(e.overcovered, b.overcovered);
  const double grace = 2e-6 * b.samples + (pole ? 1e-2 : 1e-4) * b.most_sum;
  EXPECT_GE(e.sum_squared_m2, b.least_sum - grace);
  EXPECT_LE(e.sum_squared_m2, b.most_sum + grace);
  EXPECT_LT(b.most_sum - b.least_sum, 0.2 * b.most_sum + 1);
}

Samples shifted(const Samples& s, std::int64_t west) {
  Samples t = s;
  t.west = west;
  return t;
}

TEST(surface_error, fine_tile_at_the_equator) { agree(scene(14, {14, 20000, 8192}, 16, 1.0 / 256, hills), 1.02); }
TEST(surface_error, fine_tile_at_60_north) { agree(scene(14, {14, 20000, 13653}, 32, 1.0 / 256, hills), 1.02); }
// Points far from the middle height are rounded to coarser steps: a triangle may have corners of several kinds.
TEST(surface_error, fine_tile_with_several_steps) {
  agree(scene(14, {14, 20000, 8192}, 16, EcefSteps{1.0 / 256, 1.0 / 16, 300, 60}, hills), 1.05);
}
TEST(surface_error, fine_grid_is_exact) {
  const Scene s = scene(14, {14, 20000, 13653}, 256, 1.0 / 256, hills);
  const SurfaceError e = s.measure();
  EXPECT_LT(e.max_m, 0.2);  // rounding to 2^-8 m on slopes of 30
  EXPECT_GT(e.max_m, 0);
  EXPECT_LT(e.sum_squared_m2, 1e-9);
  EXPECT_EQ(e.samples, 257u * 257u);
}
TEST(surface_error, middle_tile_at_the_equator) { agree(scene(6, {6, 70, 32}, 8, 1.0 / 16, hills)); }
TEST(surface_error, middle_tile_at_60_north) { agree(scene(6, {6, 70, 53}, 8, 1.0 / 16, hills)); }
TEST(surface_error, middle_tile_at_the_south_pole) { agree(scene(6, {6, 70, 0}, 16, 1.0 / 16, hills)); }
TEST(surface_error, middle_tile_at_the_north_pole) { agree(scene(6, {6, 1, 63}, 16, 1.0 / 16, hills)); }

TEST(surface_error, coarse_tiles_of_a_sea) {
  for (const TileAddress tile : {TileAddress{0, 0, 0}, {0, 1, 0}, {1, 2, 1}, {2, 5, 3}, {2, 0, 1}, {3, 2, 5}})
    for (const std::int32_t cells : {4, 16}) {
      SCOPED_TRACE(testing::Message() << "z " << tile.z << " x " << tile.x << " y " << tile.y << " cells " << cells);
      const bool pole = tile.z == 0 || tile.y == 0 || tile.y + 1 == 1 << tile.z;
      agree(scene(tile.z, tile, cells, 1, sea), pole ? 1.6 : 1.15);
    }
}
TEST(surface_error, a_flat_sea_sags_by_the_square_of_the_edge) {
  Scene s = scene(6, {6, 64, 31}, 4, 1.0 / 16, sea);
  s.mesh = grid_mesh(4, 64, std::vector<std::int32_t>(25, 0));
  // Circumradius of a cell's right triangle: half its diagonal, 64 units of 1.2 km each way.
  const double half = 0.5 * std::sqrt(2.0) * 64 * 180.0 / (256 * 64) * M_PI / 180 * 6371000;
  EXPECT_NEAR(s.measure().max_m, half * half / (2 * 6371000), 0.02 * half * half / (2 * 6371000));
}

TEST(surface_error, voids_leave_samples_uncovered_and_overcovered) {
  const Terrain holes = [](std::int64_t i, std::int64_t j) {
    const bool lake = (i % 97 - 48) * (i % 97 - 48) + (j % 83 - 40) * (j % 83 - 40) < 500;
    const bool pond = (i % 41 - 20) * (i % 41 - 20) + (j % 37 - 18) * (j % 37 - 18) < 9;
    return lake || pond ? proto::kNoHeight : hills(i, j);
  };
  for (const TileAddress tile : {TileAddress{14, 20000, 8192}, {14, 7, 13653}}) {
    const Scene s = scene(14, tile, 32, 1.0 / 256, holes);
    const SurfaceError e = s.measure();
    EXPECT_GT(e.uncovered, 100u);
    EXPECT_GT(e.overcovered, 100u);
    agree(s);
  }
  const Scene grid = scene(14, {14, 20000, 8192}, 256, 1.0 / 256, holes);
  EXPECT_EQ(grid.measure().overcovered, 0u);
  EXPECT_LT(grid.measure().uncovered, 200u);  // samples whose six triangles all have a void corner
}

TEST(surface_error, antimeridian_and_window_do_not_change_it) {
  const Scene east = scene(14, {14, 32767, 9000}, 16, 1.0 / 256, hills);
  agree(east);
  const SurfaceError e = east.measure();
  const std::int64_t circle = east.lattice.columns();
  for (const std::int64_t west : {east.west() - circle, east.west() + circle}) {
    Scene s = east;
    s.samples = shifted(east.samples, west);
    EXPECT_EQ(s.measure().max_m, e.max_m);
    EXPECT_EQ(s.measure().sum_squared_m2, e.sum_squared_m2);
  }
  // The whole circle once, begun in the middle of the tile: its columns lie at both ends of the window.
  Scene s = scene(2, {2, 3, 1}, 16, 1.0 / 16, hills);
  const SurfaceError whole = s.measure();
  const auto columns = static_cast<std::int32_t>(s.lattice.columns());
  Samples circle_samples{s.west() + 100 + 3 * columns, s.samples.south, columns, s.samples.rows, {}, {}};
  for (std::int64_t r = 0; r < s.samples.rows; ++r)
    for (std::int64_t c = 0; c < columns; ++c) {
      const std::int64_t x = (c + 100) % columns;
      circle_samples.height.push_back(x <= s.mesh.side ? s.samples.height[static_cast<std::size_t>(r * s.samples.columns + x)]
                                                       : 0);
    }
  s.samples = circle_samples;
  EXPECT_EQ(s.measure().max_m, whole.max_m);
  EXPECT_EQ(s.measure().sum_squared_m2, whole.sum_squared_m2);
  EXPECT_EQ(s.measure().samples, whole.samples);
}

TEST(surface_error, outside_the_window_is_invalid) {
  Scene s = scene(14, {14, 20000, 8192}, 16, 1.0 / 256, hills);
  const Samples all = s.samples;
  s.samples = {all.west + 60, all.south - 3, 150, 200, {}, {}};
  for (std::int64_t j = 0; j < s.samples.rows; ++j)
    for (std::int64_t i = 0; i < s.samples.columns; ++i)
      s.samples.height.push_back(j < 3 ? proto::kNoHeight : all.at(s.samples.west + i, s.samples.south + j));
  agree(s);
  EXPECT_GT(s.measure().overcovered, 20000u);
}

TEST(surface_error, names_the_worst_sample_of_each_triangle_above_the_limit) {
  Scene s = scene(14, {14, 20000, 8192}, 4, 1.0 / 256, sea);
  s.samples.height[100 * 257 + 90] = 50 * 1024;
  s.samples.height[101 * 257 + 90] = -70 * 1024;
  const SurfaceError e = s.measure(40);
  ASSERT_EQ(e.over_limit.size(), 1u);
  EXPECT_EQ(e.over_limit[0].x, 90);
  EXPECT_EQ(e.over_limit[0].y, 101);
  EXPECT_NEAR(e.over_limit[0].error_m, 70, 0.1);
  EXPECT_EQ(e.over_limit[0].error_m, e.max_m);
  EXPECT_TRUE(s.measure(71).over_limit.empty());
}

TEST(surface_error, coarse_rounding_is_seen) {
  Scene s = scene(14, {14, 20000, 8192}, 32, 2, sea);  // a step of 2 m on cells of 4.9 m
  agree(s, 1.6);
  EXPECT_GT(s.measure().max_m, 0.5);
  EXPECT_LT(s.measure().sum_squared_m2, 1e-3);
}

}  // namespace
}  // namespace cordillera::gpu
