// Which plans have all levels above their blocks made at once, and a ground around the earth that is cut elsewhere.
#include "pipeline/build/exact/exact_above.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tests/gpu/regular_mesh.h"

namespace cordillera::pipeline {
namespace {

/// Exact, with blocks of 1024 cells a way.
proto::Plan exact_plan(int finest_level, std::array<std::int64_t, 4> window) {
  proto::Plan plan;
  plan.set_exact(true);
  plan.set_finest_level(static_cast<std::uint32_t>(finest_level));
  plan.set_block_level(static_cast<std::uint32_t>(finest_level - 2));
  for (const std::int64_t side : window) plan.add_window(static_cast<std::int32_t>(side));
  return plan;
}
/// Inside of so many blocks of level 13.
proto::Plan plan_of_blocks(std::int64_t across, std::int64_t up) {
  return exact_plan(13, {4097, 2049, 4096 + 1024 * across - 1, 2048 + 1024 * up - 1});
}

TEST(BlocksAtOnce, AreAsManyAsOneRectangleHolds) {
  EXPECT_TRUE(has_one_ground(plan_of_blocks(63, 2)));
  EXPECT_FALSE(has_one_ground(plan_of_blocks(64, 2)));  // positions have 16 bits
  EXPECT_TRUE(has_one_ground(plan_of_blocks(2, 63)));
  EXPECT_FALSE(has_one_ground(plan_of_blocks(2, 64)));
  EXPECT_TRUE(has_one_ground(plan_of_blocks(32, 32)));
  EXPECT_FALSE(has_one_ground(plan_of_blocks(32, 33)));  // more memory than that is not asked for
}

TEST(BlocksAtOnce, GoAroundTheEarth) {
  for (const auto& [level, at_once] : {std::pair{6, true}, std::pair{7, false}}) {
    const proto::Lattice lattice{level};
    for (const std::int64_t west : {std::int64_t{0}, lattice.columns() / 2 - 300}) {
      const proto::Plan plan = exact_plan(level, {west, 0, west + lattice.columns(), lattice.rows()});
      const BlockGrid grid = grid_of(plan);
      EXPECT_TRUE(grid.closes);
      EXPECT_EQ(grid.west, 0);
      EXPECT_EQ(grid.across, proto::tiles_across(level - 2));
      EXPECT_EQ(has_one_ground(plan), at_once) << level;
    }
  }
}

// A tile of level 0 is half of the circle: where the window meets one at both of its ends, the tile's halves lie apart else.
TEST(BlocksAtOnce, GoAroundTheEarthWhereATileLiesAtBothEnds) {
  const proto::Lattice lattice{5};
  const std::int64_t half = lattice.columns() / 2;
  EXPECT_TRUE(grid_of(exact_plan(5, {half - 3000, 4000, 2 * half + 3000, 4100})).closes);
  EXPECT_FALSE(grid_of(exact_plan(5, {half + 10, 4000, 2 * half + 3000, 4100})).closes);
}

/// All levels of its plan ask the same of it.
gpu::exact::Ground ground_around(std::int32_t columns, std::int32_t rows) {
  std::mt19937 random(7);
  gpu::exact::Ground ground;
  ground.columns = columns, ground.rows = rows;
  ground.goes_on = {false, true, false, true};
  ground.cut_column = (columns - 1) / 2;
  for (std::size_t k = 0; k < ground.across() * ground.up(); ++k) {
    ground.squares.plane.push_back({static_cast<float>(random() % 1000), 0, 0, 1});
    ground.squares.depth.push_back(static_cast<gpu::exact::Depth>(random() % 16));
    for (int s = 0; s < 64; ++s) ground.squares.code.push_back(static_cast<std::uint8_t>(random()));
  }
  return ground;
}

// Every square comes to where its place is, and twice half of the circle is all of it. The last column is beyond the sides.
TEST(HalfTurned, GroundsHaveTheirHalvesTheOtherWayAround) {
  const gpu::exact::Ground ground = ground_around(4097, 41), turned = half_turned(ground), again = half_turned(turned);
  EXPECT_EQ(turned.west, ground.west + 2048);
  EXPECT_EQ(turned.columns, ground.columns);
  EXPECT_EQ(turned.goes_on, ground.goes_on);
  EXPECT_EQ(turned.cut_column, 2048);
  for (std::size_t y = 0; y < ground.up(); ++y) {
    for (std::size_t x = 0; x < 513; ++x) {
      const std::size_t here = y * 513 + x, there = y * 513 + (x + 256) % 512;
      EXPECT_EQ(turned.squares.plane[here].middle, ground.squares.plane[there].middle);
      EXPECT_EQ(turned.squares.depth[here], ground.squares.depth[there]);
      EXPECT_TRUE(
          std::equal(&turned.squares.code[64 * here], &turned.squares.code[64 * here] + 64, &ground.squares.code[64 * there]));
      if (x == 512) continue;
      EXPECT_EQ(again.squares.plane[here].middle, ground.squares.plane[here].middle);
    }
  }
}

/// A vertex each so many samples, with heights and voids that tell them apart.
gpu::exact::BlockMesh mesh_around(std::int32_t columns, std::int32_t rows, std::int32_t step) {
  gpu::exact::BlockMesh mesh = gpu::exact::regular_mesh(columns, rows, step, 0);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const std::int32_t x = mesh.x[v] % (columns - 1) / step, y = mesh.y[v] / step;
    mesh.height[v] = 100 * x + y;
    mesh.is_void[v] = (x + y) % 3 == 0 ? 1 : 0;
  }
  return mesh;
}

/// What its triangles say, `columns_on` farther east around the circle.
std::multiset<std::array<std::int32_t, 12>> corners_of(const gpu::exact::BlockMesh& mesh, std::int32_t columns,
                                                       std::int32_t east) {
  std::multiset<std::array<std::int32_t, 12>> all;
  for (const auto& t : mesh.triangles) {
    std::array<std::int32_t, 12> corners{};
    const std::int32_t least = std::min({mesh.x[t[0]], mesh.x[t[1]], mesh.x[t[2]]});
    const std::int32_t turn = (least + east) / (columns - 1) * (columns - 1);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<std::int32_t, 4> corner{mesh.x[t[k]] + east - turn, mesh.y[t[k]], mesh.height[t[k]], mesh.is_void[t[k]]};
      std::copy(corner.begin(), corner.end(), corners.begin() + static_cast<std::ptrdiff_t>(4 * k));
    }
    all.insert(corners);
  }
  return all;
}

TEST(HalfTurned, MeshesKeepTheirTriangles) {
  constexpr std::int32_t kColumns = 4097;
  const gpu::exact::BlockMesh mesh = mesh_around(kColumns, 257, 64), turned = half_turned(mesh, kColumns);
  EXPECT_EQ(turned.vertices(), mesh.vertices());
  EXPECT_EQ(corners_of(turned, kColumns, 0), corners_of(mesh, kColumns, 2048));
  EXPECT_EQ(corners_of(half_turned(turned, kColumns), kColumns, 0), corners_of(mesh, kColumns, 0));
}

TEST(HalfTurned, MeshesWhoseSidesDifferAreNotTaken) {
  gpu::exact::BlockMesh mesh = mesh_around(257, 65, 64);
  ++mesh.height[0];
  EXPECT_THROW(half_turned(mesh, 257), std::logic_error);
}

/// The reach that is left of 2^5 samples, of 2048 x 2048 samples with data where has_data says.
template <class HasData>
int reach_left(const HasData& has_data, int least = 0, int most = 5) {
  constexpr std::int32_t kSide = 2048;
  proto::Samples samples;
  samples.columns = samples.rows = kSide;
  for (std::int32_t y = 0; y < kSide; ++y)
    for (std::int32_t x = 0; x < kSide; ++x) samples.height.push_back(has_data(x, y) ? 0 : proto::kNoHeight);
  gpu::exact::BlockPlan plan;
  for (int l = 0; l < 9; ++l) plan.levels.emplace_back().rim_reach = l == 0 ? -1 : std::min(l, most);
  keep_narrow_data(places_of_data(samples), least, plan);
  for (int l = 1; l < 9; ++l) EXPECT_EQ(plan.levels[l].rim_reach, std::min(l, plan.levels.back().rim_reach)) << l;
  EXPECT_EQ(plan.levels[0].rim_reach, -1);
  return plan.levels.back().rim_reach;
}

TEST(NarrowData, RimsMoveLessWhereItWouldGo) {
  const auto band = [](int wide) { return [wide](int x, int y) { return std::abs(y - 300 - x / 2) <= wide / 2; }; };
  EXPECT_EQ(reach_left(band(10)), 0);
  EXPECT_EQ(reach_left(band(40)), 2);
  EXPECT_EQ(reach_left(band(40), 4), 4) << "finer levels have moved them as far";
  EXPECT_EQ(reach_left([](int x, int y) { return x % 100 < 9 && y % 100 < 9; }), 0) << "spots";
}

TEST(NarrowData, RimsOfOtherDataMoveAsTheyDid) {
  EXPECT_EQ(reach_left([](int, int) { return true; }), 5);
  EXPECT_EQ(reach_left([](int, int) { return false; }), 5);
  EXPECT_EQ(reach_left([](int x, int y) { return x + y < 2048; }, 0, 1), 1) << "small data, whose rims move by no more";
  EXPECT_EQ(reach_left([](int x, int y) { return x + y < 2048; }), 5) << "an outline";
  EXPECT_EQ(reach_left([](int x, int y) { return std::hypot(x % 400 - 200, y % 400 - 200) > 60; }), 5) << "lakes";
  EXPECT_EQ(reach_left([](int x, int y) { return x % 20 > 3 || y % 20 > 3; }), 5) << "small voids, which rims close";
}

}  // namespace
}  // namespace cordillera::pipeline
