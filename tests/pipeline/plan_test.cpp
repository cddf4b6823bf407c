// Which tiles a plan's window touches, and what points of its .glb tiles are rounded to.
#include "pipeline/plan/plan.h"
#include "pipeline/build/blank_manifest.h"
#include "pipeline/plan/ecef_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

namespace cordillera::pipeline {
namespace {

using proto::TileAddress;

proto::Plan plan_with(int finest_level, std::array<std::int64_t, 4> window) {
  proto::Plan plan;
  plan.set_finest_level(static_cast<std::uint32_t>(finest_level));
  for (const std::int64_t side : window) plan.add_window(static_cast<std::int32_t>(side));
  return plan;
}

/// By the definition: the closed rectangle of the tile meets the closed window, in some turn.
bool touches(const proto::Plan& plan, const TileAddress& tile) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t size = lattice.tile_units(tile.z);
  if (lattice.south(tile) > plan.window(3) || lattice.south(tile) + size < plan.window(1)) return false;
  for (int turn = -1; turn <= 1; ++turn) {
    const std::int64_t west = lattice.west(tile) + turn * lattice.columns();
    if (west <= plan.window(2) && west + size >= plan.window(0)) return true;
  }
  return false;
}

TEST(TouchedTiles, AreThoseWhoseClosedRectangleMeetsTheWindow) {
  std::mt19937 random(3);
  constexpr int kFinest = 4;
  const proto::Lattice lattice{kFinest};
  for (int round = 0; round < 60; ++round) {
    // Some end on a tile's side, some go on beyond the antimeridian, one goes around.
    const std::int64_t grain = round % 3 == 0 ? 256 : 1;
    const auto at = [&](std::int64_t below) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(below / grain)) * grain;
    };
    const std::int64_t west = at(lattice.columns()), south = at(lattice.rows());
    const std::int64_t east = round == 59 ? west + lattice.columns() : west + at(lattice.columns());
    const proto::Plan plan = plan_with(kFinest, {west, south, east, std::min(lattice.rows(), south + at(lattice.rows()))});
    for (int z = 0; z <= kFinest; ++z) {
      std::vector<TileAddress> wanted;
      for (std::int32_t y = 0; y < proto::tiles_up(z); ++y)
        for (std::int32_t x = 0; x < proto::tiles_across(z); ++x)
          if (touches(plan, {z, x, y})) wanted.push_back({z, x, y});
      EXPECT_EQ(touched_tiles(plan, z), wanted) << "window " << west << ' ' << south << ' ' << east << ", level " << z;
      const TileAddress node{1, 3, 0};
      if (z < node.z) continue;
      std::erase_if(wanted, [&](const TileAddress& t) { return (t.x >> (z - 1)) != node.x || (t.y >> (z - 1)) != node.y; });
      EXPECT_EQ(touched_tiles(plan, z, node), wanted);
    }
  }
}

TEST(NodeWindow, OfARootIsNoWiderThanItWhereDataGoesAround) {
  const proto::Plan plan = plan_with(2, {0, 20, 2048, 1000});
  for (const std::int32_t x : {0, 1}) {
    const raster::Source::Window window = node_window(plan, {0, x, 0});
    EXPECT_EQ(window.west, 1024 * x);
    EXPECT_EQ(window.east, 1024 * (x + 1));
    EXPECT_EQ(window.south, 20);
    EXPECT_EQ(window.north, 1000);
  }
}

// Pixels in degrees become narrow towards a pole, and cells of the lattice as much.
TEST(LevelRange, OfPixelsInDegreesIsTheSameUpToAPole) {
  constexpr double kPixel_deg = 0.01, kDegree_m = 111195;
  for (const double latitude : {0.0, 46.0, 72.0, 85.0, 89.5, 89.95}) {
    proto::Source source;
    source.set_columns(100), source.set_rows(10);
    source.set_pixel_height_m(kPixel_deg * kDegree_m);
    source.set_pixel_width_m(kPixel_deg * kDegree_m * std::cos(latitude / 180 * std::numbers::pi));
    for (const double side : {10.0, latitude - 0.05, 11.0, latitude + 0.05}) source.add_bbox(side);
    EXPECT_EQ(level_range(source, {})->first, 7) << latitude;
  }
}

TEST(LevelRange, OfCoarsePixelsHasRoomForExact) {
  constexpr double kDegree_m = 111195;
  proto::Source source;
  source.set_columns(40), source.set_rows(30);
  source.set_pixel_height_m(kDegree_m), source.set_pixel_width_m(kDegree_m);
  for (const double side : {0.0, -15.0, 40.0, 15.0}) source.add_bbox(side);
  const auto finest = [&](const auto& set) {
    proto::BuildOptions options;
    set(options);
    return level_range(source, options)->first;
  };
  EXPECT_EQ(finest([](proto::BuildOptions&) {}), 2) << "a cell of level 0 is 78 km wide";
  EXPECT_EQ(finest([](proto::BuildOptions& options) { options.set_strategy("cleap"); }), 2);
  EXPECT_EQ(finest([](proto::BuildOptions& options) { options.add_keep(0.5); }), 2);
  EXPECT_EQ(finest([](proto::BuildOptions& options) { options.set_max_level(0); }), 0) << "who says a level has it";
}

TEST(TouchedTiles, OfANodeAreNotLookedForInTheWholeLevel) {
  // The whole earth at level 20: its finest level has 2^41 tiles, which nobody could list.
  const proto::Lattice lattice{20};
  const proto::Plan plan = plan_with(20, {0, 0, lattice.columns(), lattice.rows()});
  EXPECT_EQ(touched_tiles(plan, 20, {16, 70000, 30000}).size(), 256U);
}

/// Of the finest level of an exact plan for a square of some tiles of it.
gpu::EcefSteps steps_of(int finest_level, double target_m, std::optional<std::pair<double, double>> seen_m) {
  const proto::Lattice lattice{finest_level};
  const std::int64_t middle = lattice.rows() * 3 / 4;
  proto::Plan plan = plan_with(finest_level, {middle, middle, middle + 2000, middle + 2000});
  plan.set_exact(true);
  if (seen_m) {
    plan.add_seen_heights(seen_m->first);
    plan.add_seen_heights(seen_m->second);
  }
  proto::LevelPlan level;
  level.set_level(static_cast<std::uint32_t>(finest_level));
  level.set_target(target_m);
  set_ecef_steps(plan, level);
  return ecef_steps(level);
}

TEST(EcefStep, OfCoarseLevelsIsOneAtAllHeights) {
  const gpu::EcefSteps steps = steps_of(12, 7, std::pair(100, 4000));
  EXPECT_EQ(steps.finest_m, 0x1p-7);
  EXPECT_EQ(steps.coarsest_m, steps.finest_m);
}

// Columns beside a pole are narrow: a window of many reaches no farther than it is high.
TEST(EcefStep, BesideAPoleIsThatOfAWindowAsWideOnTheGround) {
  const proto::Lattice lattice{10};
  const auto step_m = [&](std::int32_t west, std::int32_t south, std::int32_t columns, std::int32_t rows) {
    proto::Plan plan = plan_with(10, {west, south, west + columns, south + rows});
    plan.set_exact(true);
    proto::LevelPlan level;
    level.set_level(1);
    level.set_target(9800);
    set_ecef_steps(plan, level);
    return level.ecef_step();
  };
  const auto rows = static_cast<std::int32_t>(lattice.rows());
  // 88 rows from the pole a column is a thousandth of a row wide.
  EXPECT_EQ(step_m(0, rows - 80, 100000, 80), step_m(0, rows / 2, 100, 100));
  EXPECT_GT(step_m(0, rows / 2, 100000, 80), 64 * step_m(0, rows / 2, 100, 100));
  EXPECT_GT(step_m(0, rows / 4, 100000, rows - rows / 4), 64 * step_m(0, rows / 2, 100, 100))
      << "to the pole, and over the equator";
}

TEST(EcefStep, OfPointsBesideAPoleIsFinerAndOfAllOthersAsItIs) {
  proto::Plan plan = plan_with(12, {0, 0, 4000, 4000});
  plan.set_exact(true);
  plan.add_seen_heights(100);
  plan.add_seen_heights(4000);
  proto::LevelPlan level;
  level.set_level(12);
  level.set_target(7);
  set_ecef_steps(plan, level);
  const gpu::EcefSteps steps = ecef_steps(level);
  const proto::Lattice lattice{12};
  const auto at = [&](std::int64_t to_pole) {
    return steps.at(proto::ecef(proto::row_frame(lattice, lattice.rows() - to_pole), proto::column_frame(lattice, 0), 2000),
                    2000);
  };
  EXPECT_EQ(at(lattice.rows() / 2), 0x1p-7);
  EXPECT_EQ(at(20000), 0x1p-7) << "two degrees";
  EXPECT_EQ(at(700), 0x1p-8) << "13 km, of 16";
  EXPECT_EQ(at(1), 0x1p-13);
  level.set_level(0);
  set_ecef_steps(plan, level);
  EXPECT_EQ(ecef_steps(level).near_pole_m, 0) << "its tiles have both poles";
}

TEST(EcefStep, OfFineLevelsDoublesWithTheDistanceFromTheMiddle) {
  const gpu::EcefSteps steps = steps_of(17, 0.15, std::pair(100, 300));
  EXPECT_EQ(steps.finest_m, 0x1p-12) << "a 512th of the target";
  EXPECT_EQ(steps.between(100, 300), 0x1p-12);
  EXPECT_EQ(steps.between(-312, 712), 0x1p-12) << "half a kilometre around the middle";
  EXPECT_EQ(steps.between(712.5, 712.5), 0x1p-11);
  EXPECT_EQ(steps.between(-312.5, 200), 0x1p-11);
  EXPECT_EQ(steps.between(200, 1224), 0x1p-11);
  EXPECT_EQ(steps.between(200, 1225), 0x1p-10);
  EXPECT_EQ(steps.between(-16384, 16384), 0x1p-8) << "no coarser than without heights";
  EXPECT_EQ(steps_of(17, 0.15, std::nullopt).between(100, 300), 0x1p-8);
}

TEST(EcefStep, IsNoFinerThanDracoTakes) {
  for (const int level : {17, 20, 22}) EXPECT_GE(steps_of(level, 0.01, std::pair(5, 5)).finest_m, 0x1p-14) << level;
}

TEST(EcefStep, OfCoarseTargetsNeedsNoHeights) {
  const auto needs = [](int level, double target_m) {
    proto::Plan plan = plan_with(level, {600'000, 600'000, 602'000, 602'000});
    plan.set_exact(true);
    return needs_heights(plan, target_m);
  };
  EXPECT_TRUE(needs(17, 0.15));
  EXPECT_TRUE(needs(17, 1));
  EXPECT_TRUE(needs(12, 0.15));
  EXPECT_FALSE(needs(12, 7));
}

raster::MosaicMember member(const char* name, std::array<double, 4> bbox, double pixel_m) {
  raster::MosaicMember made;
  made.name = name;
  for (const double side : bbox) made.description.add_bbox(side);
  made.description.set_pixel_height_m(pixel_m);
  return made;
}

TEST(Notes, NameAFinerRasterThatACoarserOneHides) {
  const auto coarse = member("coarse.tif", {10, 46, 12, 48}, 90), fine = member("fine.tif", {11, 47, 11.5, 47.5}, 10),
             finer = member("finer.tif", {10, 46, 11, 47}, 5), beside = member("beside.tif", {11, 47, 13, 47.5}, 10),
             alike = member("alike.tif", {11, 47, 11.5, 47.5}, 70);
  EXPECT_FALSE(note_on_hidden({fine, coarse}));
  EXPECT_FALSE(note_on_hidden({coarse, beside, alike}));
  EXPECT_EQ(
      note_on_hidden({coarse, beside, fine}),
      "fine.tif is finer than coarse.tif, which is named before it, covers it and is shown in its place; to show it, name it "
      "first");
  EXPECT_TRUE(note_on_hidden({coarse, fine, finer})->ends_with(" (and 1 more)"));
}

}  // namespace
}  // namespace cordillera::pipeline
