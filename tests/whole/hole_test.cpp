// Where there is no data there is no surface, and where there is, there is one.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;
using testing::Le;
using testing::Optional;

/// Valid samples that no triangle covers, and void ones that one does, both farther than rim_cells from the rim.
struct Coverage {
  int uncovered = 0, overcovered = 0, seen = 0;
};
Coverage coverage(const Built& built, int level, std::int64_t rim_units, std::int64_t stride) {
  Coverage result;
  const proto::Samples& s = built.samples;
  for (std::int64_t j = s.south - 4; j < s.south + s.rows + 4; j += stride) {
    for (std::int64_t i = s.west - 4; i < s.west + s.columns + 4; i += stride) {
      const bool valid = built.truth(i, j).has_value();
      bool deep = true;
      for (std::int64_t dj = -rim_units; deep && dj <= rim_units; ++dj)
        for (std::int64_t di = -rim_units; deep && di <= rim_units; ++di) deep = built.truth(i + di, j + dj).has_value() == valid;
      if (!deep) continue;
      ++result.seen;
      if (covered(built, level, i, j) != valid) ++(valid ? result.uncovered : result.overcovered);
    }
  }
  return result;
}

/// most: share of the samples that may be shown wrongly so far from a rim.
void expect_coverage(const Built& built, double most = 0) {
  double moved = 0;  // on the way up every level may move a rim once more: in all by less than its cell
  for (const proto::LevelPlan& plan : built.plan.levels()) {
    moved += plan.rim_tolerance();
    EXPECT_LE(moved, static_cast<double>(built.lattice.cell_units(static_cast<int>(plan.level()))));
    const auto rim = static_cast<std::int64_t>(moved);
    const Coverage c = coverage(built, static_cast<int>(plan.level()), rim + 1, 3);
    EXPECT_GT(c.seen, 100) << "level " << plan.level();
    EXPECT_LE(c.uncovered, most * c.seen) << "level " << plan.level() << " of " << c.seen << ", rim " << rim;
    EXPECT_LE(c.overcovered, most * c.seen) << "level " << plan.level() << " of " << c.seen << ", rim " << rim;
  }
}

/// Single samples west of a tile's side that has ground beyond it: no triangle of their tiles says that they are there.
TEST(hole, data_of_tiles_without_a_triangle_counts_as_uncovered) {
  constexpr int kColumns = 200, kRows = 160, kGround = 5;
  const Corner corner{9, 300 * 256 - kGround, 150 * 256 + 40};
  int valid = 0;
  const auto islands = [](int c, int r) { return c < kGround || (c % 8 == 0 && r % 4 == 0) ? 100.0 : kNoData; };
  for (int r = 0; r < kRows; ++r)
    for (int c = 0; c < kColumns; ++c) valid += islands(c, r) != kNoData ? 1 : 0;
  const Built built = build_dem(points_of(corner, kColumns, kRows, islands), exact(2));
  const proto::LevelSummary& finest = built.manifest.levels(0);
  EXPECT_EQ(finest.valid_samples(), valid);
  EXPECT_GE(finest.uncovered_samples(), valid - kGround * kRows);
  const proto::ErrorAtPixels& pixels = built.manifest.source().error_at_pixels();
  EXPECT_EQ(pixels.pixels() + pixels.uncovered(), valid);
}

TEST(hole, is_empty_and_its_rim_stays) {
  const HeightOf ground = rough(3);
  const auto height = [&](int c, int r) { return c >= 80 && c < 140 && r >= 60 && r < 100 ? kNoData : ground(c, r); };
  const Built built = build_dem(points_of(kCorner, 300, 220, height), with_error(5));
  EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty());
  expect_coverage(built);
  for (const auto& [z, level] : built.levels)
    EXPECT_FALSE(covered(built, z, kCorner.west + 110, kCorner.north - 80)) << "level " << z;
}

TEST(hole, over_the_corner_of_four_tiles) {
  const HeightOf ground = rough(4);
  const auto height = [&](int c, int r) {
    return std::hypot(c - 226, r - 150) < 30 ? kNoData : ground(c, r);
  };  // centred on the corner
  const Built built = build_dem(points_of(kCorner, 400, 300, height), with_error(5));
  EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty());
  expect_coverage(built);
  for (const auto& [z, level] : built.levels) EXPECT_FALSE(covered(built, z, 9001 * kTile, 6000 * kTile)) << "level " << z;
}

TEST(hole, ragged_ones_all_over) {
  const HeightOf ground = rough(8), gaps = rough(9);
  const auto height = [&](int c, int r) { return gaps(3 * c, 3 * r) > 800 ? kNoData : ground(c, r); };
  for (const double error : {2.0, 40.0}) {
    const Built built = build_dem(points_of(kCorner, 350, 280, height), with_error(error));
    EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty()) << "error " << error;
    // Where a hole narrower than the tolerance meets a tile's border, a crack of one unit may stay beside it.
    expect_coverage(built, 0.004);
  }
}

TEST(hole, a_picture) {
  const Picture picture{{"................",  //
                         ".111111...2222..",  //
                         ".1....1...2..2..",  //
                         ".1.33.1...2222..",  //
                         ".1.33.1.........",  //
                         ".1....1....4....",  //
                         ".111111.........",  //
                         "................"}};
  const Built built = build_dem(cells_of(kCorner, picture.width(), picture.height(), picture), with_error(1));
  EXPECT_THAT(judge_plans(built), IsEmpty());
  EXPECT_THAT(judge_errors(built, {70000, 0}), IsEmpty());
  // A pixel is four lattice vertices here, its own corners: at the finest level every pixel is seen or not, as drawn.
  const Level& finest = built.finest();
  for (int r = 0; r < picture.height(); ++r) {
    for (int c = 0; c < picture.width(); ++c) {
      bool seen = false;
      for (const auto& [at, tile] : finest) {
        const std::int64_t i = kCorner.west + c, j = kCorner.north - r;
        seen = seen || (covered(tile, built.lattice, i, j) && covered(tile, built.lattice, i + 1, j) &&
                        covered(tile, built.lattice, i, j - 1) && covered(tile, built.lattice, i + 1, j - 1));
      }
      EXPECT_TRUE(seen || picture(c, r) == kNoData) << "pixel " << c << " " << r;
    }
  }
}

TEST(hole, a_one_pixel_island_is_there_at_the_finest_level) {
  const auto height = [](int c, int r) { return c == 60 && r == 40 ? 50.0 : (c < 20 ? 10.0 : kNoData); };
  const Built built = build_dem(cells_of(kCorner, 100, 80, height), with_error(1));
  EXPECT_THAT(judge(built, {70000, 0}), IsEmpty());
  for (const std::int64_t di : {0, 1})
    for (const std::int64_t dj : {0, 1}) {
      const std::int64_t i = kCorner.west + 60 + di, j = kCorner.north - 40 - dj;
      EXPECT_TRUE(covered(built, 13, i, j)) << di << " " << dj;
      EXPECT_THAT(error_at(built, 13, i, j, 50), Optional(Le(1.0)));
    }
  EXPECT_FALSE(covered(built, 13, kCorner.west + 63, kCorner.north - 40));
}

TEST(hole, filled_or_given_a_height) {
  const auto height = [](int c, int r) { return std::hypot(c - 50, r - 50) < 10 ? kNoData : 100.0; };
  proto::BuildOptions options = with_error(1);
  options.set_voids("fill");
  const Built filled = build_dem(points_of(kCorner, 101, 101, height), options);
  EXPECT_THAT(judge(filled, {70000, 0}), IsEmpty());
  EXPECT_THAT(error_at(filled, 13, kCorner.west + 50, kCorner.north - 50, 100), Optional(Le(1.0)));
  options.set_voids("7");
  const Built given = build_dem(points_of(kCorner, 101, 101, height), options);
  EXPECT_THAT(judge(given, {70000, 0}), IsEmpty());
  EXPECT_THAT(error_at(given, 13, kCorner.west + 50, kCorner.north - 50, 7), Optional(Le(1.0)));
}

}  // namespace
}  // namespace cordillera::whole
