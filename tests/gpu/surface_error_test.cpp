// The error of a tile against rays cast, sample by sample, at every triangle near it.
#include "gpu/measure/surface_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <tuple>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/simplify.h"

namespace cordillera::gpu {
namespace {

using proto::Lattice;
using proto::Samples;
using proto::TileAddress;
using proto::TileMesh;
using Point = std::array<long double, 3>;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross_product(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
long double product(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Textbook geodetic to ECEF, with the library's sines.
Point position(const Lattice& lattice, std::int64_t i, std::int64_t j, long double h) {
  const long double lon = (-180 + 360.0L * i / lattice.columns()) * M_PIl / 180,
                    lat = (-90 + 180.0L * j / lattice.rows()) * M_PIl / 180;
  const long double f = 1 / 298.257223563L, e2 = f * (2 - f), n = 6378137 / std::sqrt(1 - e2 * std::sin(lat) * std::sin(lat));
  const long double r = 2 * std::abs(j - lattice.rows() / 2) == lattice.rows() ? 0 : (n + h) * std::cos(lat);
  return {r * std::cos(lon), r * std::sin(lon), (n * (1 - e2) + h) * std::sin(lat)};
}
Point up(const Lattice& lattice, std::int64_t i, std::int64_t j) {
  return minus(position(lattice, i, j, 1), position(lattice, i, j, 0));
}

struct Scene {
  Lattice lattice;
  TileAddress tile;
  TileMesh mesh;
  Samples samples;
  EcefSteps steps;

  std::int64_t west() const { return lattice.west(tile); }
  std::int64_t south() const { return lattice.south(tile); }
  std::int32_t truth(std::int64_t x, std::int64_t y) const {
    const std::int64_t r = south() + y - samples.south, circle = lattice.columns();
    const std::int64_t c = (((west() + x - samples.west) % circle) + circle) % circle;
    if (r < 0 || r >= samples.rows) return proto::kNoHeight;
    for (const std::int64_t k : {c, c + circle})
      if (k < samples.columns) return samples.height[static_cast<std::size_t>(r * samples.columns + k)];
    return proto::kNoHeight;
  }
  bool published(const std::array<std::uint32_t, 3>& t) const { return is_published(mesh, t); }
  SurfaceErrorInput input() const {
    SurfaceErrorInput in;
    in.lattice = &lattice;
    in.tile = tile;
    in.mesh = &mesh;
    in.samples = &samples;
    in.ecef_steps = steps;
    return in;
  }
  SurfaceError measure(double limit_m = 1e9) const { return surface_error(input(), limit_m); }
};

using Terrain = std::function<std::int32_t(std::int64_t i, std::int64_t j)>;

/// A grid mesh of `cells` cells a side whose inner vertices are moved about, heights true, and diagonals turned at random.
Scene scene(int finest, TileAddress tile, std::int32_t cells, const EcefSteps& steps, const Terrain& anywhere) {
  Scene s;
  s.lattice.finest_level = finest;
  s.tile = tile;
  s.steps = steps;
  const auto side = static_cast<std::int32_t>(s.lattice.tile_units(tile.z));
  const auto terrain = [&](std::int64_t i, std::int64_t j) {  // a pole is one point
    return anywhere(j == 0 || j == s.lattice.rows() ? 0 : i, j);
  };
  s.samples = {s.west(), s.south(), side + 1, side + 1, {}, {}};
  for (std::int64_t y = 0; y <= side; ++y)
    for (std::int64_t x = 0; x <= side; ++x) s.samples.height.push_back(terrain(s.west() + x, s.south() + y));
  const std::vector<std::int32_t> flat(static_cast<std::size_t>((cells + 1) * (cells + 1)), 0);
  const std::int32_t step = side / cells;
  s.mesh = grid_mesh(cells, step, flat);
  std::mt19937 random(static_cast<unsigned>(finest * 1000 + tile.x * 10 + tile.y));
  const auto jitter = [&](std::int32_t& at) {
    if (at > 0 && at < side && step > 3) at += static_cast<std::int32_t>(random() % static_cast<unsigned>(step / 2)) - step / 4;
  };
  for (std::size_t v = 0; v < s.mesh.vertices(); ++v) {
    jitter(s.mesh.x[v]);
    jitter(s.mesh.y[v]);
    const std::int32_t h = s.truth(s.mesh.x[v], s.mesh.y[v]);
    s.mesh.mark[v] = h == proto::kNoHeight ? proto::kVoid : 0;
    s.mesh.height[v] = h == proto::kNoHeight ? 0 : h;
  }
  for (std::size_t t = 0; t + 1 < s.mesh.triangles.size(); t += 2) {
    if (random() % 2) continue;
    const auto a = s.mesh.triangles[t];
    const auto nw = s.mesh.triangles[t + 1][2];
    const auto area = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
      const auto &x = s.mesh.x, &y = s.mesh.y;
      return std::int64_t{x[q] - x[p]} * (y[r] - y[p]) - std::int64_t{y[q] - y[p]} * (x[r] - x[p]);
    };
    if (area(a[0], a[1], nw) <= 0 || area(a[1], a[2], nw) <= 0) continue;
    s.mesh.triangles[t] = {a[0], a[1], nw};
    s.mesh.triangles[t + 1] = {a[1], a[2], nw};
  }
  return s;
}

struct Brute {
  double max_m = 0;                    ///< over both decodings and all hits
  double least_sum = 0, most_sum = 0;  ///< of squares; a sample on several triangles may take any of them
  std::uint32_t samples = 0, uncovered = 0, overcovered = 0, hits = 0;
};

/// Möller and Trumbore's ray and triangle; the ray both ways. infinity: no hit,
/// or one beyond the middle of the earth.
long double ray(const Point& from, const Point& along, const std::array<Point, 3>& t, long double grace) {
  const Point e1 = minus(t[1], t[0]), e2 = minus(t[2], t[0]), p = cross_product(along, e2);
  const long double det = product(e1, p);
  if (det == 0) return INFINITY;
  const Point s = minus(from, t[0]), q = cross_product(s, e1);
  const long double u = product(s, p) / det, v = product(along, q) / det;
  const long double hit = product(e2, q) / det;
  return u < -grace || v < -grace || u + v > 1 + grace || std::abs(hit) > 4e6 ? INFINITY : hit;
}

Brute brute(const Scene& s) {
  Brute b;
  const std::int32_t side = s.mesh.side;
  struct Shown {
    std::array<Point, 3> exact, rounded;
    std::array<std::int64_t, 3> x, y;
    bool area;
  };
  std::vector<Shown> shown;
  for (const auto& t : s.mesh.triangles) {
    if (!s.published(t)) continue;
    Shown one;
    for (unsigned k = 0; k < 3; ++k) {
      one.x[k] = s.mesh.x[t[k]];
      one.y[k] = s.mesh.y[t[k]];
      one.exact[k] = position(s.lattice, s.west() + one.x[k], s.south() + one.y[k], s.mesh.height[t[k]] / 1024.0L);
      const double height_m = s.mesh.height[t[k]] / 1024.0;
      const double apart_m = std::abs(height_m - s.steps.middle_m);
      double step_m = s.steps.finest_m;
      while (step_m < s.steps.coarsest_m && apart_m > s.steps.near_m * step_m / s.steps.finest_m) step_m *= 2;
      for (unsigned c = 0; c < 3; ++c) one.rounded[k][c] = std::nearbyint(static_cast<double>(one.exact[k][c]) / step_m) * step_m;
    }
    const Point n = cross_product(minus(one.exact[1], one.exact[0]), minus(one.exact[2], one.exact[0]));
    one.area = product(n, n) > 0;
    shown.push_back(one);
  }
  for (std::int64_t y = 0; y <= side; ++y) {
    for (std::int64_t x = 0; x <= side; ++x) {
      const std::int32_t h = s.truth(x, y);
      const bool valid = h != proto::kNoHeight;
      const Point from = position(s.lattice, s.west() + x, s.south() + y, valid ? h / 1024.0L : 0);
      const Point along = up(s.lattice, s.west() + x, s.south() + y);
      bool covered = false, summed = false, strictly = false;
      double least = INFINITY, most = 0;
      for (const Shown& t : shown) {
        const auto turn = [&](unsigned k) {
          const unsigned n = (k + 1) % 3;
          return (t.x[n] - t.x[k]) * (y - t.y[k]) - (t.y[n] - t.y[k]) * (x - t.x[k]);
        };
        const auto [west, east] = std::minmax({t.x[0], t.x[1], t.x[2]});
        const auto [south, north] = std::minmax({t.y[0], t.y[1], t.y[2]});
        const std::int64_t near = std::max(east - west, north - south);
        if (x < west - near || x > east + near || y < south - near || y > north + near) continue;
        const std::int64_t inside = std::min({turn(0), turn(1), turn(2)});
        strictly |= inside > 0;
        if (!valid) continue;
        for (const auto* corners : {&t.exact, &t.rounded}) {
          const long double hit = ray(from, along, *corners, 0);
          if (std::isinf(hit) || !t.area) continue;
          ++b.hits;
          b.max_m = std::max(b.max_m, static_cast<double>(std::abs(hit)));
        }
        if (inside < 0) continue;
        covered = true;
        if (!t.area) continue;
        summed = true;
        const double e = static_cast<double>(std::abs(ray(from, along, t.exact, 1e9L)));
        least = std::min(least, e);
        most = std::max(most, e);
      }
      if (!valid) b.overcovered += strictly;
      if (valid && !covered) ++b.uncovered;
      if (!summed) continue;
      ++b.samples;
      b.least_sum += least * least;
      b.most_sum += most * most;
    }
  }
  return b;
}

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
