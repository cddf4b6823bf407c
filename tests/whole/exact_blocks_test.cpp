// Blocks of an exact build and the levels above them: made at once from all of them, wherever they lie.
#include <gmock/gmock.h>

#include <cmath>
#include <set>

#include "pipeline/build/build.h"
#include "pipeline/plan/block_grid.h"
#include "tests/whole/above_blocks.h"
#include "tests/whole/bytes.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

// Blocks of four tiles, with holes across their sides, noise of holes, and islands whose blocks have neighbours without data.
TEST(ExactBlocks, levels_above_are_made_at_once) {
  const Built built = build_dem(points_of(kHoleyCorner, 3000, 900, holey_ground(2700, 2300, 400)), exact(15), kSmallBlock);
  EXPECT_EQ(built.plan.block_level(), 12u);
  EXPECT_TRUE(pipeline::has_levels_above(built.plan));
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  expect_promise_above_blocks(built);
}

// What blocks leave is kept in memory where there is room for it, and read from the store where there is none, or where another
// process made the block.
TEST(ExactBlocks, leave_the_same_kept_and_read_again) {
  Folder folder;
  const HeightOf ground = rough(7);
  write(points_of(kCorner, 2100, 1100, [=](int c, int r) { return std::hypot(c - 600, r - 500) < 60 ? kNoData : ground(c, r); }),
        folder.path("dem.tif"));
  pipeline::BuildRequest request;
  request.raster_path = folder.path("dem.tif");
  request.raster_name = "dem.tif";
  request.id = "test";
  request.block_samples = kSmallBlock;
  const auto bytes = [&](const std::string& name, unsigned memory_mib, unsigned stopped_after) {
    request.options = exact(30);
    request.options.set_threads(2);
    request.options.set_memory(memory_mib);
    request.store_path = folder.path(name);
    std::atomic<bool> stop{false};
    if (stopped_after > 0) {
      const auto watch = [&](const proto::Progress& progress) { stop = stop || progress.blocks() >= stopped_after; };
      EXPECT_FALSE(pipeline::build(request, watch, stop).ok());
      stop = false;
    }
    const auto built = pipeline::build(request, nullptr, stop);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    return published(request.store_path);
  };
  const Bytes kept = bytes("kept", 0, 0);
  EXPECT_GT(kept.size(), 20u);
  EXPECT_EQ(kept, bytes("read", 1, 0));
  EXPECT_EQ(kept, bytes("both", 0, 2));
}

// A hundredth of a metre is hardly more than what a float32 tells of a place: above blocks most of the target is set aside for
// that, and rounding may take more than the rest.
TEST(ExactBlocks, take_the_least_error) {
  const HeightOf ground = rough(8);
  const Built built =
      build_dem(points_of(kCorner, 3000, 40, [=](int c, int r) { return 0.01 * ground(c, r); }), exact(0.01), kSmallBlock);
  EXPECT_TRUE(pipeline::has_levels_above(built.plan));
  for (const proto::LevelSummary& level : built.manifest.levels())
    EXPECT_LE(level.stated_max_error(), 1.25 * level.target()) << "level " << level.level();
}

// The triangles that a raster in one piece has, nearly: what is known of samples above blocks is nearly all.
TEST(ExactBlocks, cost_few_triangles) {
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
TEST(ExactBlocks, go_on_across_meridians) {
  for (const std::int64_t meridian : {std::int64_t{0}, std::int64_t{8192} * kTile}) {
    const Built built =
        build_dem(points_of({13, meridian - 600, 6000 * kTile + 150}, 1200, 400, rough(3)), exact(15), kSmallBlock);
    EXPECT_TRUE(pipeline::has_levels_above(built.plan));
    EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty()) << meridian;
    expect_promise_above_blocks(built);
  }
}

// A tile of level 0 is half of the circle: where the raster meets one of them at both of its ends, all of the circle is one
// piece.
TEST(ExactBlocks, go_over_half_of_the_circle) {
  const HeightOf ground = rough(3);
  for (const auto& [columns, closes] : {std::pair{10012, true}, std::pair{9098, false}}) {
    const Built built = build_dem(points_of({5, 7282, 6000}, columns, 60, [=](int c, int r) { return ground(c / 4, r / 4); }),
                                  exact(400), kSmallBlock);
    EXPECT_TRUE(pipeline::has_levels_above(built.plan));
    EXPECT_EQ(pipeline::grid_of(built.plan).closes, closes) << columns;
    EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty()) << columns;
    expect_promise_above_blocks(built);
  }
}

/// Vertices of a level on a meridian, by row; on the eastern side of its tiles.
std::size_t vertices_on(const Built& built, int level, std::int64_t column) {
  std::set<std::int64_t> rows;
  for (const auto& [at, tile] : built.levels.at(level)) {
    for (std::size_t v = 0; v < tile.drc.u.size(); ++v) {
      const bool on_side = std::int64_t{at.x} * tile.drc.side == column && tile.drc.u[v] == 0;
      if (on_side) rows.insert(std::int64_t{at.y} * tile.drc.side + tile.drc.v[v]);
    }
  }
  return rows.size();
}

void expect_one_piece_around_the_earth(const Built& built) {
  EXPECT_TRUE(pipeline::has_levels_above(built.plan));
  EXPECT_TRUE(pipeline::grid_of(built.plan).closes);
  EXPECT_THAT(judge_wide(built), IsEmpty());
  expect_promise_above_blocks(built);
  for (const proto::LevelSummary& level : built.manifest.levels()) EXPECT_TRUE(level.has_rmse()) << "level " << level.level();
}

TEST(ExactBlocks, close_around_the_earth) {
  const Built built = build_dem(all_around(2880, 1440, 90), exact(1500), kSmallBlock);
  EXPECT_EQ(built.plan.block_level(), 2u);
  expect_one_piece_around_the_earth(built);
}

// Triangles beside a pole are long and thin, and in space they lie elsewhere than on the lattice. Targets may be missed there,
// and that is said.
TEST(ExactBlocks, state_what_is_true_of_spikes_beside_a_pole) {
  Dem dem = all_around(2880, 80, 90);
  dem.height = [ground = dem.height](int c, int r) {
    const std::uint32_t hash = (static_cast<std::uint32_t>(c) * 2654435761u ^ static_cast<std::uint32_t>(r) * 2246822519u) >> 16;
    return 0.2 * ground(c, r) + (hash % 250 == 0 ? 4000 : hash % 250 == 1 ? -3000 : 0);
  };
  const Built built = build_dem(dem, exact(60), kSmallBlock);
  EXPECT_TRUE(pipeline::grid_of(built.plan).closes && pipeline::has_levels_above(built.plan));
  EXPECT_EQ(built.manifest.source().nodata_share(), 0) << "the antimeridian is one column";
  Findings untrue;
  for (const std::string& finding : judge_errors(built, {std::int64_t{1} << 40, 0})) {
    if (finding.find(" but is ") != std::string::npos) untrue.push_back(finding);
  }
  EXPECT_THAT(untrue, IsEmpty());
}

// Beside a pole columns are closer than the steps that points of tiles are rounded to elsewhere: triangles turned over, and
// targets were missed by far. Here nothing is allowed that is not allowed elsewhere.
TEST(ExactBlocks, of_rough_ground_around_a_pole_keep_their_promise) {
  constexpr double kPixel_m = 500;
  Dem dem;
  dem.columns = dem.rows = 20;
  dem.crs = "EPSG:3413";
  dem.geotransform = {-9.6 * kPixel_m, kPixel_m, 0, 10.3 * kPixel_m, 0, -kPixel_m};
  dem.height = [ground = rough(6)](int c, int r) { return 2 * ground(40 * c, 40 * r); };
  const Built built = build_dem(dem, exact(75));
  EXPECT_THAT(judge(built, {4000, 1.25}), IsEmpty());
  for (const proto::LevelSummary& level : built.manifest.levels())
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
}

// The line where a level's ground is cut has no fewer vertices than a level below: the next ones are cut elsewhere.
TEST(ExactBlocks, are_cut_elsewhere_on_each_level) {
  const Built built = build_dem(all_around(5760, 96, 40), exact(100), kSmallBlock);
  EXPECT_EQ(built.plan.block_level(), 3u);
  expect_one_piece_around_the_earth(built);
  const std::int64_t half = built.lattice.columns() / 2;
  // Levels 2 and 0 are cut at the antimeridian, level 1 at Greenwich.
  EXPECT_EQ(vertices_on(built, 2, 0), vertices_on(built, 3, 0));
  EXPECT_LT(vertices_on(built, 2, half), vertices_on(built, 3, half));
  EXPECT_LT(vertices_on(built, 1, 0), vertices_on(built, 2, 0));
  EXPECT_EQ(vertices_on(built, 1, half), vertices_on(built, 2, half));
  EXPECT_LT(vertices_on(built, 0, half), vertices_on(built, 1, half));
}

// So wide that positions have all of their 16 bits.
TEST(ExactBlocks, wide_rasters_are_one_piece) {
  const HeightOf ground = rough(5);
  const auto height = [=](int c, int r) { return c < 300 || c > 59700 ? ground(c, r) : 3.0; };
  const Built built = build_dem(points_of({13, 500 * 2 * kTile - 100, 6000 * kTile + 150}, 60000, 30, height), exact(5));
  EXPECT_TRUE(pipeline::has_levels_above(built.plan));
  EXPECT_THAT(judge_wide(built), IsEmpty());
  expect_promise_above_blocks(built);
}

}  // namespace
}  // namespace cordillera::whole
