// Levels above the blocks of rasters that are more than one ground may hold: region by region.
#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <string>
#include <utility>

#include "pipeline/build/build.h"
#include "pipeline/check/check.h"
#include "pipeline/plan/block_grid.h"
#include "raster/mosaic/mosaic.h"
#include "tests/whole/above_blocks.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

constexpr std::int32_t kQuarter = 1024;  // two blocks a way

TEST(Regions, hold_the_laws_with_holes_and_islands) {
  const Built built =
      build_dem(points_of(kHoleyCorner, 5000, 2300, holey_ground(4700, 4300, 1400)), exact(15), kSmallBlock, kQuarter);
  EXPECT_EQ(built.plan.block_level(), 12u);
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  expect_promise_above_blocks(built);
}

// Sides of regions have a level's vertices more, and lie elsewhere on the next one.
TEST(Regions, cost_few_triangles) {
  const Dem dem = points_of({13, 4500 * kTile - 350, 3000 * kTile + 300}, 2600, 2100, rough(8));
  const Built one = build_dem(dem, exact(10), kSmallBlock), regions = build_dem(dem, exact(10), kSmallBlock, kQuarter);
  for (const int z : {12, 13}) EXPECT_EQ(regions.triangles(z), one.triangles(z)) << "level " << z;
  for (const int z : {11, 10})
    EXPECT_LE(static_cast<double>(regions.triangles(z)), 1.1 * static_cast<double>(one.triangles(z))) << "level " << z;
  for (int k = 0; k < regions.manifest.levels_size(); ++k) {
    const proto::LevelSummary &level = regions.manifest.levels(k), &same = one.manifest.levels(k);
    EXPECT_LT(level.rmse(), 1.15 * same.rmse()) << "level " << level.level();
    EXPECT_GT(level.rmse(), 0.5 * same.rmse()) << "level " << level.level();
  }
}

TEST(Regions, go_around_the_earth_and_to_its_poles) {
  const Built built = build_dem(all_around(2880, 1440, 90), exact(1500), kSmallBlock, kQuarter);
  EXPECT_TRUE(pipeline::grid_of(built.plan).closes);
  EXPECT_THAT(judge_wide(built), IsEmpty());
  expect_promise_above_blocks(built);
}

// A quarter of the default size is 8,192 samples: what lies between two islands is not made.
TEST(Regions, hold_islands_that_are_far_apart) {
  const HeightOf ground = rough(5);
  const auto height = [=](int c, int r) { return c < 300 || c > 66700 ? 0.1 * ground(c, r) : kNoData; };
  const Built built =
      build_dem(points_of({13, 500 * 2 * kTile - 100, 6000 * kTile + 150}, 67000, 30, height), exact(5), kSmallBlock);
  EXPECT_FALSE(pipeline::has_one_ground(built.plan));
  EXPECT_THAT(judge_wide(built), IsEmpty());
  expect_promise_above_blocks(built);
}

// More than 34 billion samples: parents are merged of four children, which machines can share.
TEST(Regions, give_way_to_merges) {
  const Folder folder;
  pipeline::BuildRequest request;
  request.id = "test";
  request.store_path = folder.path("two.sqlite");
  request.options = exact(20);
  request.options.set_max_level(11);
  for (const auto& [west, north] : {std::pair{100 * kTile, 1800 * kTile}, std::pair{900 * kTile, 1000 * kTile}}) {
    const std::string name = std::to_string(west) + ".tif";
    write(points_of({11, west, north}, 300, 300, rough(5)), folder.path(name));
    auto member = raster::examine(folder.path(name), name, raster::Trust::operator_file, request.options);
    ASSERT_TRUE(member.ok()) << member.problem().line();
    request.members.push_back(std::move(*member));
  }
  auto source = pipeline::open_source(request);
  ASSERT_TRUE(source.ok()) << source.problem().line();
  const auto plan = pipeline::plan_of(request, **source);
  ASSERT_TRUE(plan.ok()) << plan.problem().line();
  ASSERT_TRUE(plan->exact());
  ASSERT_FALSE(pipeline::merged_at_once(*plan));
  const std::atomic<bool> stop{false};
  const auto built = pipeline::build(request, nullptr, stop);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  EXPECT_EQ(built->levels_size(), 12);
  for (const proto::LevelSummary& level : built->levels()) {
    EXPECT_GE(level.tiles(), 1u) << "level " << level.level();
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
  }
  const auto report = pipeline::check::check_store(request.store_path, nullptr);
  ASSERT_TRUE(report.ok()) << report.problem().line();
  for (const auto& finding : report->findings.kept()) ADD_FAILURE() << finding.where << ": " << finding.what;
}

}  // namespace
}  // namespace cordillera::whole
