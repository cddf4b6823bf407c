#include "pipeline/composed_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "gpu/mend.h"
#include "gpu/rings.h"
#include "gpu/simplify.h"
#include "pipeline/overlay.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;
using proto::Vec3;

double greatest_m(const proto::Lattice& lattice, const proto::TileAddress& tile, const TileMesh& welded, const TileMesh& parent) {
  std::vector<std::uint32_t> over;
  return greatest_error_m(ComposedMeter(lattice, tile, welded), parent, INFINITY, over);
}

TileMesh surface(std::int32_t cells, std::int32_t side, const std::function<double(double, double)>& height_m) {
  std::vector<std::int32_t> heights;
  for (std::int32_t j = 0; j <= cells; ++j)
    for (std::int32_t i = 0; i <= cells; ++i)
      heights.push_back(
          static_cast<std::int32_t>(1024 * height_m(static_cast<double>(i) / cells, static_cast<double>(j) / cells)));
  return gpu::grid_mesh(cells, side / cells, heights);
}

Vec3 geodetic(double longitude_deg, double latitude_deg, double height_m) {
  const double lon = longitude_deg * M_PI / 180, lat = latitude_deg * M_PI / 180,
               e2 = proto::kFlattening * (2 - proto::kFlattening);
  const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * std::sin(lat) * std::sin(lat));
  return {(n + height_m) * std::cos(lat) * std::cos(lon), (n + height_m) * std::cos(lat) * std::sin(lon),
          (n * (1 - e2) + height_m) * std::sin(lat)};
}

// Height of the surface over a place, by looking through all triangles and solving for where the vertical line meets.
double height_over(const TileMesh& mesh, const proto::Lattice& lattice, const proto::TileAddress& tile, double x, double y) {
  const auto lon = [&](double i) {
    return -180 + 360 * (static_cast<double>(lattice.west(tile)) + i) / static_cast<double>(lattice.columns());
  };
  const auto lat = [&](double j) {
    return -90 + 180 * (static_cast<double>(lattice.south(tile)) + j) / static_cast<double>(lattice.rows());
  };
  for (const auto& t : mesh.triangles) {
    const auto p = plan_of(mesh, t);
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      const PlanPoint a = p[k], b = p[(k + 1) % 3];
      inside &= (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) >= 0;
    }
    if (!inside) continue;
    Vec3 at[3];
    for (int k = 0; k < 3; ++k) at[k] = geodetic(lon(p[k].x), lat(p[k].y), mesh.height[t[k]] / 1024.0);
    const Vec3 foot = geodetic(lon(x), lat(y), 0), up = geodetic(lon(x), lat(y), 1) - foot;
    const Vec3 m = cross(at[1] - at[0], at[2] - at[0]);
    return dot(m, at[0] - foot) / dot(m, up);
  }
  ADD_FAILURE() << "not covered";
  return 0;
}

struct Sampled {
  double stated_m = 0, sampled_m = 0;
};

Sampled compare(int finest, proto::TileAddress tile, int rough) {
  const proto::Lattice lattice{proto::Scheme::geodetic, finest};
  const auto side = static_cast<std::int32_t>(lattice.tile_units(tile.z));
  std::mt19937 random(static_cast<unsigned>(rough + tile.z));
  const auto terrain = [&](double u, double v) {
    return 500 + 40.0 * rough * std::sin(9 * u + 4 * v) + 25.0 * rough * std::cos(17 * v - 5 * u);
  };
  const TileMesh fine = surface(16, side, terrain);
  TileMesh coarse = surface(8, side, terrain);
  // Every other border vertex away: the coarse mesh is then no grid any more.
  for (std::size_t v = 0; v < coarse.vertices(); ++v)
    if ((coarse.x[v] == 0 || coarse.y[v] == 0) && (coarse.x[v] + coarse.y[v]) / (side / 8) % 2 == 1)
      coarse.mark[v] |= proto::kRemove;
  auto rings = gpu::rings_from_triangles(coarse);
  EXPECT_EQ(gpu::mend(*rings, coarse), 0u);
  coarse = gpu::mesh_from_rings(coarse, *rings);
  Sampled result{greatest_m(lattice, tile, fine, coarse), 0};
  for (int k = 0; k < 6000; ++k) {
    std::uniform_real_distribution<double> anywhere(0, side);
    const double x = anywhere(random), y = anywhere(random);
    result.sampled_m =
        std::max(result.sampled_m, std::abs(height_over(fine, lattice, tile, x, y) - height_over(coarse, lattice, tile, x, y)));
  }
  return result;
}

TEST(ComposedError, BoundsWhatSamplingFinds) {
  struct Case {
    int finest;
    proto::TileAddress tile;
    int rough;
  };
  for (const Case& c : {Case{14, {12, 5000, 2900}, 1}, Case{14, {10, 1200, 700}, 1}, Case{10, {7, 150, 100}, 1},
                        Case{10, {7, 10, 126}, 3}, Case{8, {5, 40, 16}, 0}, Case{8, {4, 20, 12}, 2}, Case{6, {3, 8, 6}, 1}}) {
    const Sampled s = compare(c.finest, c.tile, c.rough);
    EXPECT_GE(s.stated_m, s.sampled_m) << "level " << c.tile.z;
    EXPECT_LE(s.stated_m, 1.35 * s.sampled_m + 0.01) << "level " << c.tile.z << ": the bound is too weak to be of use";
    EXPECT_GT(s.sampled_m, 0.1);
  }
}

TEST(ComposedError, TheSameSurfaceIsNoDistanceAway) {
  const proto::Lattice lattice{proto::Scheme::geodetic, 12};
  const TileMesh mesh = surface(16, 1024, [](double u, double v) { return 300 * u + 50 * v * v; });
  EXPECT_LT(greatest_m(lattice, {10, 700, 650}, mesh, mesh), 0.05);
}

TEST(ComposedError, OneVertexOff) {
  const proto::Lattice lattice{proto::Scheme::geodetic, 12};
  const TileMesh flat = surface(16, 1024, [](double, double) { return 100; });
  TileMesh spike = flat;
  spike.height[17 * 8 + 8] += 30 * 1024;
  const double found = greatest_m(lattice, {10, 700, 650}, spike, flat);
  EXPECT_NEAR(found, 30, 0.02);
  EXPECT_GE(found, 30 - 1e-6);
}

TEST(ComposedError, PolesAreNoExceptionAndTheGlobeHasABound) {
  const proto::Lattice lattice{proto::Scheme::geodetic, 4};
  const auto hills = [](double u, double v) { return 1200 * std::sin(7 * u) * v * (1 - v); };
  for (const int z : {0, 1, 3}) {
    const auto side = static_cast<std::int32_t>(lattice.tile_units(z));
    const TileMesh fine = surface(32, side, hills), coarse = surface(16, side, hills);
    const double found = greatest_m(lattice, {z, 0, 0}, fine, coarse);
    // A chord over 11.25 degrees sags 30.7 km, over half of them 7.7 km; twice as finely a level.
    EXPECT_GT(found, 15000 / std::pow(4.0, z)) << z;
    EXPECT_LT(found, 120000 / std::pow(4.0, z)) << z;
  }
}

TEST(ComposedError, VoidsAreNotCompared) {
  const proto::Lattice lattice{proto::Scheme::geodetic, 12};
  TileMesh one = surface(16, 1024, [](double, double) { return 100; });
  TileMesh other = one;
  other.height[17 * 8 + 8] += 30 * 1024;
  other.mark[17 * 8 + 8] |= proto::kVoid;
  EXPECT_LT(greatest_m(lattice, {10, 700, 650}, one, other), 0.01);
}

TEST(Overlay, CommonPartOfTwoTriangles) {
  const auto area = [](const Common& c) {
    double twice = 0;
    for (int k = 0; k < c.count; ++k) {
      const PlanPoint a = c.corner[k], b = c.corner[(k + 1) % c.count];
      twice += a.x * b.y - a.y * b.x;
    }
    return twice / 2;
  };
  EXPECT_DOUBLE_EQ(area(common_part({{{0, 0}, {4, 0}, {0, 4}}}, {{{0, 0}, {4, 0}, {4, 4}}})), 4);
  EXPECT_DOUBLE_EQ(area(common_part({{{0, 0}, {9, 0}, {0, 9}}}, {{{1, 1}, {2, 1}, {1, 2}}})), 0.5);
  EXPECT_EQ(common_part({{{0, 0}, {1, 0}, {0, 1}}}, {{{5, 5}, {6, 5}, {5, 6}}}).count, 0);
}

}  // namespace
}  // namespace cordillera::pipeline
