// A raster in one piece: the laws hold on all levels, every error is measured, blocks that meet fit, and nothing else shows in
// the bytes.
#include <gmock/gmock.h>

#include <cmath>

#include "pipeline/build/build.h"
#include "pipeline/plan/block_grid.h"
#include "tests/whole/bytes.h"
#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

proto::BuildOptions exact(double error_m) {
  proto::BuildOptions options = with_error(error_m);
  options.set_strategy("exact");
  return options;
}

/// Every level measured, and within its target.
void expect_promise(const Built& built) {
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
    EXPECT_FALSE(level.composed()) << "level " << level.level();
  }
}

TEST(ExactStrategy, obeys_every_law_around_holes) {
  const HeightOf ground = rough(8), gaps = rough(9);
  const auto height = [=](int c, int r) {
    const bool hole = std::hypot(c - 226, r - 150) < 25 || (c > 260 && gaps(3 * c, 3 * r) > 900);
    return hole ? kNoData : ground(c, r);
  };
  const Built built = build_dem(points_of(kCorner, 400, 300, height), exact(10));
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  expect_promise(built);
}

TEST(ExactStrategy, shows_every_pixel_at_the_finest_level) {
  const auto height = [](int c, int r) { return c == 60 && r == 40 ? 50.0 : (c < 20 ? 10.0 : kNoData); };
  const Built built = build_dem(cells_of(kCorner, 100, 80, height), exact(1));
  EXPECT_THAT(judge(built, {70000, 0}), IsEmpty());
  for (const std::int64_t di : {0, 1}) {
    for (const std::int64_t dj : {0, 1})
      EXPECT_TRUE(covered(built, 13, kCorner.west + 60 + di, kCorner.north - 40 - dj)) << di << " " << dj;
  }
  EXPECT_FALSE(covered(built, 13, kCorner.west + 63, kCorner.north - 40));
}

// Four nodes of the coarsest level, none of which sees another.
TEST(ExactStrategy, blocks_that_meet_fit) {
  constexpr std::int64_t kNode = 8 * kTile;
  const Corner corner{13, 1125 * kNode - 350, 750 * kNode + 300};
  proto::BuildOptions options = exact(15);
  options.set_min_level(10);
  const Built built = build_dem(points_of(corner, 700, 600, rough(4)), options);
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  EXPECT_EQ(built.levels.at(10).size(), 4u);
  expect_promise(built);
}

/// Every level within its target: measured in blocks, a bound above them.
void expect_promise_above_blocks(const Built& built) {
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
    EXPECT_EQ(level.composed(), level.level() < built.plan.block_level()) << "level " << level.level();
  }
}
constexpr std::int64_t kSmallBlock = 513 * 513;

// Blocks of four tiles, with holes across their sides, noise of holes, and islands whose blocks have neighbours without data.
TEST(ExactStrategy, levels_above_small_blocks_are_made_at_once) {
  constexpr std::int64_t kNode = 2 * kTile;
  const Corner corner{13, 4500 * kNode - 350, 3000 * kNode + 300};
  const HeightOf ground = rough(4), gaps = rough(9);
  const auto height = [=](int c, int r) {
    const bool hole = std::hypot(c - 350, r - 280) < 40 || (c > 900 && c < 1400 && gaps(3 * c, 3 * r) > 900);
    return hole || (c > 1400 && c < 2700 && std::hypot(c - 2300, r - 400) > 90) ? kNoData : ground(c, r);
  };
  const Built built = build_dem(points_of(corner, 3000, 900, height), exact(15), kSmallBlock);
  EXPECT_EQ(built.plan.block_level(), 12u);
  EXPECT_TRUE(pipeline::merged_at_once(built.plan));
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  expect_promise_above_blocks(built);
}

// A hundredth of a metre is hardly more than what a float32 tells of a place: above blocks most of the target is set aside for
// that, and rounding may take more than the rest.
TEST(ExactStrategy, small_blocks_take_the_least_error) {
  const HeightOf ground = rough(8);
  const Built built =
      build_dem(points_of(kCorner, 3000, 40, [=](int c, int r) { return 0.01 * ground(c, r); }), exact(0.01), kSmallBlock);
  EXPECT_TRUE(pipeline::merged_at_once(built.plan));
  for (const proto::LevelSummary& level : built.manifest.levels())
    EXPECT_LE(level.stated_max_error(), 1.25 * level.target()) << "level " << level.level();
}

// The triangles that a raster in one piece has, nearly: what is known of samples above blocks is nearly all.
TEST(ExactStrategy, small_blocks_cost_few_triangles) {
  const Dem dem = points_of(kCorner, 1500, 1200, rough(8));
  const Built whole = build_dem(dem, exact(10)), blocks = build_dem(dem, exact(10), kSmallBlock);
  ASSERT_EQ(whole.plan.block_level(), 0u);
  ASSERT_EQ(blocks.plan.block_level(), 12u);
  for (const int z : {13, 12})
    EXPECT_LE(static_cast<double>(blocks.triangles(z)), 1.08 * static_cast<double>(whole.triangles(z))) << "level " << z;
  for (const int z : {11, 10, 9})
    EXPECT_LE(static_cast<double>(blocks.triangles(z)), 1.10 * static_cast<double>(whole.triangles(z))) << "level " << z;
  // Of coarse tiles, which the data fills a little of, too.
  for (int k = 0; k < blocks.manifest.levels_size(); ++k) {
    const proto::LevelSummary &level = blocks.manifest.levels(k), &same = whole.manifest.levels(k);
    EXPECT_TRUE(level.has_rmse()) << "level " << level.level();
    EXPECT_NEAR(level.rmse() / same.rmse(), 1, 0.15) << "level " << level.level();
  }
}

// A rectangle of blocks goes on beyond the meridian where the lattice begins again, and over the one in its middle.
TEST(ExactStrategy, small_blocks_go_on_across_meridians) {
  for (const std::int64_t meridian : {std::int64_t{0}, std::int64_t{8192} * kTile}) {
    const Built built =
        build_dem(points_of({13, meridian - 600, 6000 * kTile + 150}, 1200, 400, rough(3)), exact(15), kSmallBlock);
    EXPECT_TRUE(pipeline::merged_at_once(built.plan));
    EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty()) << meridian;
    expect_promise_above_blocks(built);
  }
}

// A tile of level 0 is half of the circle: this raster meets one of them at both of its ends, or ends where another begins.
TEST(ExactStrategy, small_blocks_go_over_half_of_the_circle) {
  const HeightOf ground = rough(3);
  for (const auto& [columns, at_once] : {std::pair{10012, false}, std::pair{9098, true}}) {
    const Built built = build_dem(points_of({5, 7282, 6000}, columns, 60, [=](int c, int r) { return ground(c / 4, r / 4); }),
                                  exact(400), kSmallBlock);
    EXPECT_EQ(pipeline::merged_at_once(built.plan), at_once) << columns;
    EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty()) << columns;
    expect_promise_above_blocks(built);
  }
}

// Too wide for one rectangle: parents are merged of four children.
TEST(ExactStrategy, blocks_far_apart_are_merged_level_by_level) {
  const HeightOf ground = rough(5);
  const auto height = [=](int c, int r) { return c < 300 || c > 16700 ? 0.1 * ground(c, r) : kNoData; };
  const Built built =
      build_dem(points_of({13, 4500 * 2 * kTile - 100, 6000 * kTile + 150}, 17000, 300, height), exact(5), kSmallBlock);
  EXPECT_TRUE(built.plan.exact());
  EXPECT_FALSE(pipeline::merged_at_once(built.plan));
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  expect_promise_above_blocks(built);
}

// Cells of two kilometres: between vertices the earth falls away by more than the error that is asked for.
TEST(ExactStrategy, sees_the_curvature_of_the_earth) {
  const Corner corner{5, 9000, 6800};
  const Built built = build_dem(
      points_of(corner, 300, 200, [](int c, int r) { return c > 150 ? 0.0 : 40.0 * ((c * 7 + r * 3) % 11); }), exact(100));
  EXPECT_THAT(judge(built, {20000, 0}), IsEmpty());
  expect_promise(built);
}

// On walls of 1,500 m a point that is rounded sideways is off in height by more than what was set aside for it. Vertices go in
// there, and the rest of the raster stays as it is.
TEST(ExactStrategy, puts_vertices_back_at_steep_walls) {
  const HeightOf ground = rough(8);
  const auto houses = [ground](int c, int r) { return ground(c, r) + ((c / 29 + r / 23) % 4 == 0 ? 1500.0 : 0.0); };
  const Built built = build_dem(points_of(kCorner, 300, 200, houses), exact(1));
  EXPECT_THAT(judge(built, {20000, 0}), IsEmpty());
  expect_promise(built);
  std::uint64_t put_back = 0;
  for (const proto::LevelSummary& level : built.manifest.levels()) put_back += level.put_back();
  EXPECT_GT(put_back, 0u);
}

TEST(ExactStrategy, bytes_do_not_depend_on_threads) {
  Folder folder;
  write(points_of(kCorner, 600, 400, rough(6)), folder.path("dem.tif"));
  pipeline::BuildRequest request;
  request.raster_path = folder.path("dem.tif");
  request.raster_name = "dem.tif";
  request.id = "test";
  request.options = exact(12);
  const std::atomic<bool> never = false;
  const auto bytes = [&](unsigned threads, std::int64_t block_samples = 0) {
    request.options.set_threads(threads);
    request.block_samples = block_samples;
    request.store_path = folder.path(std::to_string(threads) + " " + std::to_string(block_samples));
    const auto built = pipeline::build(request, nullptr, never);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    return published(request.store_path);
  };
  const Bytes one = bytes(1);
  EXPECT_GT(one.size(), 10u);
  EXPECT_EQ(one, bytes(3));
  EXPECT_EQ(bytes(1, kSmallBlock), bytes(3, kSmallBlock));
}

TEST(ExactStrategy, what_it_cannot_do_is_said) {
  Folder folder;
  const std::atomic<bool> never = false;
  const auto refusal = [&](const Dem& dem, const proto::BuildOptions& options) {
    write(dem, folder.path("dem.tif"));
    pipeline::BuildRequest request;
    request.raster_path = folder.path("dem.tif");
    request.raster_name = "dem.tif";
    request.id = "test";
    request.options = options;
    request.store_path = folder.path("store");
    const auto built = pipeline::build(request, nullptr, never);
    return built.ok() ? std::string("built") : built.problem().type + ": " + built.problem().detail;
  };
  const auto flat = [](int, int) { return 100.0; };
  proto::BuildOptions shares = plain_options();
  shares.set_strategy("exact");
  shares.add_keep(0.2);
  EXPECT_THAT(refusal(points_of(kCorner, 40, 40, flat), shares), HasSubstr("options-conflict: strategy exact keeps an error"));
}

}  // namespace
}  // namespace cordillera::whole
