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

using testing::IsEmpty;

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

// A block a tile, or four: nothing is made above them.
TEST(ExactStrategy, few_levels_are_enough) {
  const HeightOf ground = rough(8), gaps = rough(9);
  const auto height = [=](int c, int r) { return c > 260 && gaps(3 * c, 3 * r) > 900 ? kNoData : ground(c, r); };
  proto::BuildOptions options = exact(10);
  for (const std::uint32_t coarsest : {13u, 12u}) {
    options.set_min_level(coarsest);
    const Built built = build_dem(points_of(kCorner, 700, 600, height), options);
    EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty()) << coarsest;
    EXPECT_GT(built.levels.at(13).size(), 4u);
    expect_promise(built);
  }
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

}  // namespace
}  // namespace cordillera::whole
