// Levels above the blocks of rasters that are more than one ground may hold: region by region.
#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/build/builder.h"
#include "pipeline/check/check.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
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

// Four hundred thousand blocks, and two of them with data.
TEST(Regions, may_be_mostly_empty) {
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
  ASSERT_FALSE(pipeline::has_one_ground(*plan));
  const std::atomic<bool> stop{false};
  const auto built = pipeline::build(request, nullptr, stop);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  EXPECT_EQ(built->levels_size(), 12);
  for (const proto::LevelSummary& level : built->levels()) {
    constexpr unsigned kSeen = 4;  // from farther away two spots are nothing
    EXPECT_EQ(level.tiles() > 0, level.level() >= kSeen) << "level " << level.level();
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
  }
  const auto report = pipeline::check::check_store(request.store_path, nullptr);
  ASSERT_TRUE(report.ok()) << report.problem().line();
  for (const auto& finding : report->findings.kept()) ADD_FAILURE() << finding.where << ": " << finding.what;
}

/// What is said to be done of the levels above the blocks, each time.
std::vector<double> shares_above_blocks(std::int32_t quarter_side) {
  const Folder folder;
  write(points_of({13, 4500 * kTile - 350, 3000 * kTile + 300}, 1500, 1300, rough(8)), folder.path("dem.tif"));
  pipeline::BuildRequest request;
  request.raster_path = folder.path("dem.tif");
  request.id = "test";
  request.options = exact(10);
  request.options.set_max_level(13);
  request.block_samples = kSmallBlock;
  request.quarter_side = quarter_side;
  auto source = pipeline::open_source(request);
  if (!source.ok()) throw std::runtime_error(source.problem().line());
  const auto plan = pipeline::plan_of(request, **source);
  if (!plan.ok()) throw std::runtime_error(plan.problem().line());
  const std::atomic<bool> stop{false};
  pipeline::Workers workers(2);
  pipeline::Builder builder(
      *plan, workers, [&] { return pipeline::open_source(request); }, {"cpu", 0, quarter_side}, stop);
  if (const auto ready = builder.prepare(); !ready.ok()) throw std::runtime_error(ready.problem().line());
  std::map<proto::TileAddress, std::string> left;
  for (const proto::TileAddress& node : pipeline::touched_tiles(*plan, static_cast<int>(plan->block_level()))) {
    auto block = builder.block(node, [](double) {});
    if (!block.ok()) throw std::runtime_error(block.problem().line());
    if (block->mesh) left[node] = block->mesh->second;
  }
  std::vector<double> shares;
  const auto above = builder.merge(
      [&](const proto::TileAddress& node) -> proto::Result<std::optional<std::string>> {
        return left.contains(node) ? std::optional(left[node]) : std::nullopt;
      },
      [&](double share) { shares.push_back(share); });
  if (!above.ok()) throw std::runtime_error(above.problem().line());
  EXPECT_EQ(above->consumed.size(), left.size());
  return shares;
}

TEST(Regions, say_how_much_of_the_levels_above_blocks_is_done) {
  for (const std::int32_t quarter_side : {0, kQuarter}) {
    const std::vector<double> shares = shares_above_blocks(quarter_side);
    ASSERT_GE(shares.size(), 10u) << quarter_side;  // levels
    EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end())) << quarter_side;
    EXPECT_GT(shares.front(), 0) << quarter_side;
    EXPECT_LE(shares.front(), 0.5) << quarter_side;
    EXPECT_GT(shares.back(), 0.99) << quarter_side;
    EXPECT_LE(shares.back(), 1) << quarter_side;
  }
}

}  // namespace
}  // namespace cordillera::whole
