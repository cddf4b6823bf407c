// The judge of sparse starts, judged.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>

#include "gpu/simplify.h"
#include "tests/gpu/sparse_grid.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera::gpu {
namespace {

constexpr std::int32_t kCells = 32, kAcross = kCells + 1;
using Terrain = std::function<std::int32_t(std::int32_t x, std::int32_t y)>;

proto::TileMesh grid_of(const Terrain& terrain) {
  std::vector<std::int32_t> heights;
  for (std::int32_t y = 0; y <= kCells; ++y)
    for (std::int32_t x = 0; x <= kCells; ++x) heights.push_back(terrain(x, y));
  return grid_mesh(kCells, 1, heights);
}
std::vector<float> elevation_of(const proto::TileMesh& grid) {
  std::vector<float> elevation;
  for (const std::int32_t h : grid.height) elevation.push_back(static_cast<float>(h * proto::kHeightStep_m));
  return elevation;
}
test::SparseGrid sparse(const Terrain& terrain, float tolerance_m) {
  const proto::TileMesh grid = grid_of(terrain);
  return test::sparse_grid(grid, elevation_of(grid), tolerance_m);
}
std::set<std::pair<std::int32_t, std::int32_t>> places(const proto::TileMesh& mesh) {
  std::set<std::pair<std::int32_t, std::int32_t>> found;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) found.emplace(mesh.x[v], mesh.y[v]);
  return found;
}
std::int32_t hills(std::int32_t x, std::int32_t y) {
  return static_cast<std::int32_t>(20000 * std::sin(x * 0.21) * std::cos(y * 0.33) + 37 * (x * y % 11));
}
std::int32_t slope(std::int32_t x, std::int32_t y) { return 4096 * x - 1024 * y; }

/// A hole and a notch in the border, in hills.
bool in_hole(std::int32_t x, std::int32_t y) {
  return (x - 12) * (x - 12) + (y - 19) * (y - 19) < 30 || (x < 5 && y > 25 && y < 29);
}

/// Greatest distance of a grid vertex from the triangle over it, along the vertical.
double farthest_m(const proto::TileMesh& mesh, const Terrain& terrain) {
  double farthest = 0;
  for (const auto& t : mesh.triangles) {
    const auto [a, b, c] = t;
    const double area = static_cast<double>(test::twice_area(mesh, t));
    for (std::int32_t y = 0; y <= kCells; ++y) {
      for (std::int32_t x = 0; x <= kCells; ++x) {
        const auto weight = [&](std::uint32_t p, std::uint32_t q) {
          return ((mesh.x[q] - mesh.x[p]) * (y - mesh.y[p]) - (mesh.y[q] - mesh.y[p]) * (x - mesh.x[p])) / area;
        };
        const double wa = weight(b, c), wb = weight(c, a), wc = weight(a, b);
        if (wa < 0 || wb < 0 || wc < 0) continue;
        const double height = wa * mesh.height[a] + wb * mesh.height[b] + wc * mesh.height[c];
        farthest = std::max(farthest, std::abs(height - terrain(x, y)) * proto::kHeightStep_m);
      }
    }
  }
  return farthest;
}

TEST(SparseGrid, APlaneIsTwoTriangles) {
  const test::SparseGrid got = sparse(slope, 0);
  EXPECT_EQ(got.mesh.vertices(), 4u);
  EXPECT_EQ(got.mesh.triangles.size(), 2u);
  EXPECT_EQ(test::broken_law(got.mesh), "");
}

TEST(SparseGrid, LeavesOutMoreForAGreaterToleranceAndStaysNear) {
  std::size_t before = kAcross * kAcross + 1;
  for (const float tolerance_m : {0.01f, 1.0f, 4.0f, 16.0f}) {
    const test::SparseGrid got = sparse(hills, tolerance_m);
    EXPECT_EQ(test::broken_law(got.mesh), "");
    EXPECT_LT(got.mesh.vertices(), before) << tolerance_m;
    before = got.mesh.vertices();
    // Errors of one vertex after the other may add up, over no more levels than there are.
    EXPECT_LE(farthest_m(got.mesh, hills), 3 * tolerance_m) << tolerance_m;
    const test::Valences most = test::valences(got.mesh);
    EXPECT_LE(most.inside, 8u);
    EXPECT_LE(most.sides, 5u);
    EXPECT_LE(most.corners, 3u);
  }
  EXPECT_LT(before, kAcross * kAcross / 8u);
}

TEST(SparseGrid, CarriesVerticesAsTheyAre) {
  proto::TileMesh grid = grid_of(hills);
  grid.mark[5] = proto::kRemove;
  const std::vector<float> elevation = elevation_of(grid);
  const test::SparseGrid got = test::sparse_grid(grid, elevation, 0.5f);
  ASSERT_EQ(got.elevation.size(), got.mesh.vertices());
  for (std::size_t v = 0; v < got.mesh.vertices(); ++v) {
    const auto from = static_cast<std::size_t>(got.mesh.y[v] * kAcross + got.mesh.x[v]);
    EXPECT_EQ(got.mesh.height[v], grid.height[from]);
    EXPECT_EQ(got.mesh.mark[v], grid.mark[from]);
    EXPECT_EQ(got.elevation[v], elevation[from]);
  }
}

TEST(SparseGrid, KeepsWhatMustStay) {
  proto::TileMesh grid = grid_of(slope);
  for (const std::size_t v : {7u, 3u * kAcross, 17u * kAcross + 9u, 31u * kAcross + 32u}) grid.mark[v] |= proto::kKeep;
  const test::SparseGrid got = test::sparse_grid(grid, elevation_of(grid), 100);
  const auto there = places(got.mesh);
  for (const auto& place : {std::pair{7, 0}, {0, 3}, {9, 17}, {32, 31}, {0, 0}, {32, 32}}) EXPECT_TRUE(there.count(place));
  EXPECT_EQ(test::broken_law(got.mesh), "");
  EXPECT_LT(got.mesh.vertices(), 120u);
}

TEST(SparseGrid, KeepsEveryVertexOfARim) {
  const Terrain terrain = [](std::int32_t x, std::int32_t y) { return in_hole(x, y) ? proto::kNoHeight : slope(x, y); };
  const test::SparseGrid got = sparse(terrain, 100);
  EXPECT_EQ(test::broken_law(got.mesh), "");
  const auto there = places(got.mesh);
  int rim = 0;
  for (std::int32_t y = 0; y < kCells; ++y) {
    for (std::int32_t x = 0; x < kCells; ++x) {
      const int voids = in_hole(x, y) + in_hole(x + 1, y) + in_hole(x, y + 1) + in_hole(x + 1, y + 1);
      if (voids == 0 || voids == 4) continue;
      ++rim;
      for (const auto& place : {std::pair{x, y}, {x + 1, y}, {x, y + 1}, {x + 1, y + 1}})
        EXPECT_TRUE(there.count(place)) << x << ' ' << y;
    }
  }
  EXPECT_GT(rim, 20);
  EXPECT_LT(got.mesh.vertices(), kAcross * kAcross / 3u);
  for (const auto& t : got.mesh.triangles) {
    const auto has = [&](std::uint32_t v) { return is_void(got.mesh, v); };
    if (has(t[0]) != has(t[1]) || has(t[1]) != has(t[2])) { EXPECT_EQ(test::twice_area(got.mesh, t), 1); }
  }
}

TEST(SparseGrid, RefusesWhatIsNoGrid) {
  const std::vector<std::int32_t> heights(7 * 7, 0);
  const proto::TileMesh six = grid_mesh(6, 1, heights);
  EXPECT_THROW(test::sparse_grid(six, elevation_of(six), 1), std::invalid_argument);
}

}  // namespace
}  // namespace cordillera::gpu
