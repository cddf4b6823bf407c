#include "pipeline/bound/composed_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "gpu/mesh/rings.h"
#include "gpu/simplify.h"
#include "gpu/waves/border/mend.h"
#include "pipeline/bound/loose.h"
#include "pipeline/bound/overlay.h"
#include "pipeline/tile/mesh_record.h"
#include "proto/ellipsoid.h"
#include "tests/gpu/meter_glance.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;
using proto::Vec3;

double greatest_m(const proto::Lattice& lattice, const proto::TileAddress& tile, const TileMesh& welded, const TileMesh& parent) {
  std::vector<std::uint32_t> over;
  return greatest_error_m(ComposedMeter(lattice, tile, welded, 0, {}, 0x1p-20), parent, INFINITY, over);
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
  const proto::Lattice lattice{finest};
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
  const gpu::ValenceCaps caps{gpu::kInnerValence, gpu::kSharedSideValence, gpu::kSharedCornerValence};
  EXPECT_EQ(gpu::mend(*rings, coarse, caps), 0u);
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

TEST(ComposedError, AGlanceAgreesWithTheWhole) {
  const proto::Lattice lattice{12};
  const TileMesh fine = surface(16, 1024, [](double u, double v) { return 300 * u + 50 * v * v; });
  const TileMesh rough = surface(8, 1024, [](double u, double v) { return 280 * u + 60 * v; });
  const proto::TileAddress tile{10, 700, 650};
  const ComposedMeter first(lattice, tile, fine, 2, {}, 0x1p-10), second(lattice, tile, rough, 5, {}, 0x1p-10);
  gpu::expect_glance_agrees(first, 1024, 0, 350 * 1024);
  gpu::expect_glance_agrees(second, 1024, 0, 350 * 1024);
  // The lesser of two bounds.
  const NearerMeter nearer(first, second);
  const std::array<gpu::MeshPoint, 3> c{{{100, 100, 1024}, {900, 200, 90 * 1024}, {500, 800, 300 * 1024}}};
  const double one_m = first.error_m(c, INFINITY), other_m = second.error_m(c, INFINITY), least_m = std::min(one_m, other_m);
  EXPECT_EQ(nearer.error_m(c, INFINITY), one_m);
  EXPECT_EQ(nearer.error_m(c, least_m), least_m);
  EXPECT_GT(nearer.error_m(c, least_m / 2), least_m / 2);
}

TEST(ComposedError, TheSameSurfaceIsNoDistanceAway) {
  const proto::Lattice lattice{12};
  const TileMesh mesh = surface(16, 1024, [](double u, double v) { return 300 * u + 50 * v * v; });
  EXPECT_LT(greatest_m(lattice, {10, 700, 650}, mesh, mesh), 0.05);
}

TEST(ComposedError, OneVertexOff) {
  const proto::Lattice lattice{12};
  const TileMesh flat = surface(16, 1024, [](double, double) { return 100; });
  TileMesh spike = flat;
  spike.height[17 * 8 + 8] += 30 * 1024;
  const double found = greatest_m(lattice, {10, 700, 650}, spike, flat);
  EXPECT_NEAR(found, 30, 0.02);
  EXPECT_GE(found, 30 - 1e-6);
}

TEST(ComposedError, PolesAreNoExceptionAndTheGlobeHasABound) {
  const proto::Lattice lattice{4};
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
  const proto::Lattice lattice{12};
  TileMesh one = surface(16, 1024, [](double, double) { return 100; });
  TileMesh other = one;
  other.height[17 * 8 + 8] += 30 * 1024;
  other.mark[17 * 8 + 8] |= proto::kVoid;
  EXPECT_LT(greatest_m(lattice, {10, 700, 650}, one, other), 0.01);
}

constexpr proto::TileAddress kTile{10, 700, 650};
constexpr std::int32_t kSide = 1024;

// Data at 100 m in the western half alone.
TileMesh western_half() {
  TileMesh mesh = surface(16, kSide, [](double, double) { return 100; });
  for (std::size_t v = 0; v < mesh.vertices(); ++v)
    if (mesh.x[v] > kSide / 2) mesh.mark[v] |= proto::kVoid;
  return mesh;
}

Loose patch_of(const std::array<gpu::MeshPoint, 3>& corners, double error_m) {
  Loose loose;
  loose.patches.side = kSide;
  for (const gpu::MeshPoint& c : corners) {
    loose.patches.x.push_back(c.x);
    loose.patches.y.push_back(c.y);
    loose.patches.height.push_back(c.height);
    loose.patches.mark.push_back(0);
  }
  loose.patches.triangles = {{0, 1, 2}};
  loose.patch_error_m = {error_m};
  return loose;
}

constexpr double kStep_m = 0x1p-12;

TEST(Rims, ALooseSampleThatAParentCoversCountsAndGoesIn) {
  const proto::Lattice lattice{12};
  const TileMesh finer = western_half();
  TileMesh parent = surface(8, kSide, [](double, double) { return 100; });
  Loose loose;
  loose.samples = {{700, 300, 150 * 1024}, {701, 300, 98 * 1024}};
  std::vector<std::uint32_t> over;
  EXPECT_LT(greatest_error_m(ComposedMeter(lattice, kTile, finer, 3, {}, kStep_m), parent, INFINITY, over), 3.3)
      << "nothing is known there";
  const ComposedMeter meter(lattice, kTile, finer, 3, loose, kStep_m);
  EXPECT_NEAR(greatest_error_m(meter, parent, 10, over), 50, 0.3);
  ASSERT_FALSE(over.empty());
  EXPECT_GT(gpu::refine(parent, meter, 10, over, meter.points()).inserted, 0u);
  over.clear();
  EXPECT_LE(greatest_error_m(meter, parent, 10, over), 10);
  bool in = false;
  for (std::size_t v = 0; v < parent.vertices(); ++v)
    in = in || (parent.x[v] == 700 && parent.y[v] == 300 && parent.height[v] == 150 * 1024);
  EXPECT_TRUE(in);
}

TEST(Rims, ALooseSampleThatAParentLeavesOutDoesNotCount) {
  const proto::Lattice lattice{12};
  Loose loose;
  loose.samples = {{700, 300, 150 * 1024}};
  std::vector<std::uint32_t> over;
  EXPECT_LT(greatest_error_m(ComposedMeter(lattice, kTile, western_half(), 3, loose, kStep_m), western_half(), INFINITY, over),
            3.3);
}

TEST(Rims, APatchIsComposedWithByItsOwnError) {
  const proto::Lattice lattice{12};
  const Loose loose = patch_of({{{600, 100, 130 * 1024}, {900, 100, 130 * 1024}, {600, 400, 130 * 1024}}}, 2);
  const TileMesh parent = surface(8, kSide, [](double, double) { return 100; });
  std::vector<std::uint32_t> over;
  EXPECT_NEAR(greatest_error_m(ComposedMeter(lattice, kTile, western_half(), 3, loose, kStep_m), parent, INFINITY, over), 32,
              0.3);
}

bool covers(const TileMesh& mesh, const gpu::MeshPoint& p) {
  for (const auto& t : mesh.triangles) {
    const auto at = [&](int k) { return gpu::MeshPoint{mesh.x[t[k]], mesh.y[t[k]], 0}; };
    if (is_published(mesh, t) && gpu::twice_area(at(0), at(1), p) >= 0 && gpu::twice_area(at(1), at(2), p) >= 0 &&
        gpu::twice_area(at(2), at(0), p) >= 0)
      return true;
  }
  return false;
}
bool holds(const Loose& loose, const gpu::MeshPoint& p) {
  return std::any_of(loose.samples.begin(), loose.samples.end(),
                     [&](const gpu::MeshPoint& q) { return q.x == p.x && q.y == p.y; });
}

// Ragged: every third vertex or so has no data.
TileMesh ragged(std::int32_t cells, std::int32_t side, unsigned seed) {
  TileMesh mesh = surface(cells, side, [](double u, double v) { return 100 * u + 50 * v; });
  std::mt19937 random(seed);
  for (auto& mark : mesh.mark)
    if (random() % 3 == 0) mark |= proto::kVoid;
  return mesh;
}

TEST(Rims, WhatAMeshLeavesOutIsAllThere) {
  constexpr std::int32_t side = 64;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const TileMesh finer = ragged(16, side, seed), mesh = ragged(4, side, 100 + seed);
    Loose of_finer = patch_of({{{3, 5, 0}, {50, 9, 0}, {20, 60, 0}}}, 1.5);
    std::mt19937 random(seed);
    for (std::int32_t y = 0; y <= side; ++y)
      for (std::int32_t x = 0; x <= side; ++x)
        if (!covers(finer, {x, y, 0}) && random() % 2 == 0) of_finer.samples.push_back({x, y, 7});
    const LeftOut left = left_out(mesh, finer, 4, of_finer);
    int patched = 0, loose = 0, free = 0;
    for (std::int32_t y = 0; y <= side; ++y)
      for (std::int32_t x = 0; x <= side; ++x) {
        const gpu::MeshPoint p{x, y, 0};
        if (covers(mesh, p)) {
          EXPECT_FALSE(holds(left.loose, p));
          continue;
        }
        const bool known = covers(finer, p) || covers(of_finer.patches, p);
        EXPECT_TRUE(!known || covers(left.loose.patches, p)) << x << " " << y;
        EXPECT_EQ(holds(left.loose, p), holds(of_finer, p)) << x << " " << y;
        ++(known ? patched : holds(of_finer, p) ? loose : free);
      }
    EXPECT_GT(patched, 300);
    EXPECT_GT(loose, 30);
    EXPECT_GT(free, 30);
    EXPECT_LT(left.loose.patches.triangles.size(), finer.triangles.size()) << "what is covered as a whole is not handed up";
    for (const double error_m : left.loose.patch_error_m) EXPECT_TRUE(error_m == 4 || error_m == 1.5);
  }
}

TEST(Rims, UncoveredSamplesAreThoseThatNoTriangleTouches) {
  const proto::Lattice lattice{12};
  const proto::TileAddress tile{12, 2000, 1500};
  const TileMesh mesh = ragged(16, 256, 5);
  // A window that ends inside the tile, with holes of its own.
  proto::Samples samples{lattice.west(tile) - 3, lattice.south(tile) + 20, 200, 190, {}, {}};
  std::mt19937 random(8);
  for (std::int32_t k = 0; k < samples.columns * samples.rows; ++k)
    samples.height.push_back(random() % 4 == 0 ? proto::kNoHeight : k);
  std::vector<gpu::MeshPoint> found = uncovered_samples(lattice, tile, mesh, samples), expected;
  for (std::int32_t y = 20; y < 210; ++y)
    for (std::int32_t x = 0; x < 197; ++x) {
      const std::int32_t height = samples.at(lattice.west(tile) + x, lattice.south(tile) + y);
      if (height != proto::kNoHeight && !covers(mesh, {x, y, 0})) expected.push_back({x, y, height});
    }
  ASSERT_GT(expected.size(), 1000u);
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_EQ(found[k].x, expected[k].x);
    EXPECT_EQ(found[k].y, expected[k].y);
    EXPECT_EQ(found[k].height, expected[k].height);
  }
}

TEST(Rims, FourChildrenAreJoinedAndAllOfItIsStored) {
  Loose west, east = patch_of({{{1, 2, 3}, {9, 2, 4}, {1, 8, 5}}}, 2.5);
  west.patches.side = kSide;
  west.samples = {{5, 7, 1000}, {kSide, 7, -2000}};  // one of them on the common border
  east.samples = {{0, 7, -2000}, {3, 7, 20}};
  BuiltTile tile;
  tile.tile = {9, 350, 325};
  tile.mesh = surface(4, 2 * kSide, [](double, double) { return 100; });
  tile.loose = joined({&west, &east, nullptr, nullptr}, kSide);
  ASSERT_EQ(tile.loose.samples.size(), 3u);
  tile.finer = Surface{tile.mesh, 6, joined({nullptr, nullptr, nullptr, &east}, kSide)};
  const auto again = tile_from_bytes(tile.tile, to_bytes(tile));
  ASSERT_TRUE(again.ok());
  ASSERT_EQ(again->loose.samples.size(), 3u);
  EXPECT_EQ(again->loose.samples[1].x, kSide);
  EXPECT_EQ(again->loose.samples[1].height, -2000);
  EXPECT_EQ(again->loose.samples[2].x, kSide + 3);
  EXPECT_EQ(again->loose.patches.x, (std::vector<std::int32_t>{kSide + 1, kSide + 9, kSide + 1}));
  EXPECT_EQ(again->loose.patch_error_m, std::vector<double>{2.5});
  ASSERT_TRUE(again->finer);
  EXPECT_EQ(again->finer->loose.samples[0].y, kSide + 7);
  EXPECT_EQ(again->finer->loose.patches.y, (std::vector<std::int32_t>{kSide + 2, kSide + 2, kSide + 8}));
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
