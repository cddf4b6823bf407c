// keep= gives the shares asked for, and borders take part in the thinning.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

/// Triangles of the finest grid between valid samples.
double grid_triangles(const Built& built) {
  double count = 0;
  const proto::Samples& s = built.samples;
  for (std::int64_t j = s.south; j + 1 < s.south + s.rows; ++j)
    for (std::int64_t i = s.west; i + 1 < s.west + s.columns; ++i)
      count += built.truth(i, j) && built.truth(i + 1, j) && built.truth(i, j + 1) && built.truth(i + 1, j + 1) ? 2 : 0;
  return count;
}

class Keep : public testing::TestWithParam<const char*> {
 protected:
  static proto::BuildOptions shares(std::initializer_list<double> of_levels) {
    proto::BuildOptions options = plain_options();
    options.set_strategy(GetParam());
    for (const double share : of_levels) options.add_keep(share);
    return options;
  }
};

TEST_P(Keep, gives_the_shares_asked_for) {
  const proto::BuildOptions options = shares({0.5, 0.25, 0.1});
  const Built built = build_dem(points_of({13, 9000 * kTile, 6000 * kTile}, 3 * kTile + 1, 2 * kTile + 1, rough(50)), options);
  EXPECT_THAT(judge(built, {20000, 1.3}), IsEmpty());
  const double grid = grid_triangles(built);
  double wanted = 1;
  for (const auto& [z, share] : {std::pair{13, 0.5}, {12, 0.25}, {11, 0.1}, {10, 0.04}}) {
    wanted = share * grid;
    EXPECT_NEAR(static_cast<double>(built.triangles(z)) / wanted, 1, 0.1)
        << "level " << z << ": " << built.triangles(z) << " of " << wanted;
  }
}

TEST_P(Keep, of_everything_is_nearly_that) {
  proto::BuildOptions options = shares({1});
  options.set_min_level(12);
  const Built built = build_dem(points_of({13, 9000 * kTile, 6000 * kTile}, 200, 150, rough(50)), options);
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  EXPECT_GT(static_cast<double>(built.triangles(13)), 0.97 * grid_triangles(built));
}

// Targets went on falling from level to level, until no vertex of a border could be removed any more, and the build failed. Even
// ground has no more vertices to give than the least error needs.
TEST_P(Keep, of_everything_is_built_on_even_ground) {
  const Dem plane{16, 16, {8, 1.5 / 111320, 0, 45, 0, -1.5 / 111320}, [](int c, int r) { return 500 + 0.3 * c + 0.2 * r; }};
  proto::BuildOptions options = shares({1});
  options.set_min_level(10);
  const Built built = build_dem(plane, options);
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  EXPECT_EQ(built.manifest.levels(0).tolerance(), 0.01) << "the least that there is";
}

TEST_P(Keep, works_with_holes) {
  const HeightOf ground = rough(51), gaps = rough(52);
  const proto::BuildOptions options = shares({0.3, 0.1});
  const auto height = [&](int c, int r) { return gaps(c, r) > 900 ? kNoData : ground(c, r); };
  const Built built = build_dem(points_of({13, 9000 * kTile + 99, 6000 * kTile + 77}, 500, 400, height), options);
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  EXPECT_NEAR(static_cast<double>(built.triangles(13)) / (0.3 * grid_triangles(built)), 1, 0.1);
}

// Rims and corners stay, whatever the tolerance: to ask for fewer ends where nothing more goes, and no later than at what an
// error of a quarter of a cell would allow.
TEST_P(Keep, of_less_than_the_outline_needs_is_no_farther_off_for_it) {
  const HeightOf ground = rough(52);
  const Built built = build_dem(points_of({13, 9000 * kTile + 99, 6000 * kTile + 77}, 150, 9, ground), shares({0.5, 0.25, 0.01}));
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  constexpr double kRelief = 2000;
  for (const proto::LevelSummary& level : built.manifest.levels())
    EXPECT_LE(level.tolerance(), std::max(kRelief, std::ldexp(2.5, 13 - static_cast<int>(level.level())))) << level.level();
}

// Where nearly all of the ground has steps of many metres, and the rest of a metre, a hair of tolerance more or less is the same
// to all vertices. No next try followed from two that leave as many.
TEST_P(Keep, of_ground_that_has_steps_of_two_sizes_is_built) {
  const auto steps = [](int c, int r) {
    const double height = c >= 92 ? 1 : c >= 88 ? 0.05 * std::pow(40, r / 100.0) : 30 + (c * 7 + r * 13) % 20;
    return 100 + ((c + r) % 2 ? height : -height);
  };
  for (const double share : {0.996, 0.9975, 0.999}) {
    proto::BuildOptions options = shares({share, 0.3});
    options.set_min_level(12);
    const Built built = build_dem(points_of({13, 9000 * kTile, 6000 * kTile}, 100, 100, steps), options);
    EXPECT_THAT(judge(built, {20000, 0}), IsEmpty()) << share;
  }
}

INSTANTIATE_TEST_SUITE_P(Names, Keep, testing::Values("exact", "cleap"));

// Of a larger raster the shares are found on a part of it. What gives them is kept as an error.
TEST(keep, of_a_large_raster_is_found_on_a_part) {
  proto::BuildOptions options = plain_options();
  options.set_strategy("exact");
  for (const double share : {0.1, 0.03}) options.add_keep(share);
  const Built built = build_dem(points_of({13, 9000 * kTile, 6000 * kTile}, 5 * kTile + 1, 5 * kTile + 1, rough(61)), options);
  const double grid = grid_triangles(built);
  for (const auto& [z, share] : {std::pair{13, 0.1}, {12, 0.03}, {11, 0.009}})
    EXPECT_NEAR(static_cast<double>(built.triangles(z)) / (share * grid), 1, 0.1) << "level " << z;
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
    EXPECT_EQ(level.tolerance(), level.target());
  }
}

/// Vertices a cell of length on the tile's border, over the same inside: a straight line of length L through n vertices spread
/// evenly over an area A passes L * sqrt(n / A) of them.
double border_density(const Built& built, int level) {
  double border = 0, border_length = 0, inside = 0, area = 0;
  for (const auto& [at, tile] : built.levels.at(level)) {
    const DecodedTile& t = tile.drc;
    for (std::size_t k = 0; k < t.u.size(); ++k) {
      const bool on_border = t.u[k] == 0 || t.v[k] == 0 || t.u[k] == t.side || t.v[k] == t.side;
      ++(on_border ? border : inside);
    }
    border_length += 4.0 * t.side;
    area += static_cast<double>(t.side) * t.side;
  }
  return border / border_length / std::sqrt(inside / area);
}

TEST(keep, borders_are_no_denser_than_the_inside) {
  // 4 x 4 tiles, filled to their sides: the level above has 2 x 2, the next 1.
  const Built built =
      build_dem(points_of({13, 9000 * kTile, 6000 * kTile}, 4 * kTile + 1, 4 * kTile + 1, rough(60)), plain_options());
  for (const int z : {13, 12, 11}) EXPECT_LE(border_density(built, z), 1.5) << "level " << z;
  const Built promised =
      build_dem(points_of({13, 9000 * kTile, 6000 * kTile}, 4 * kTile + 1, 4 * kTile + 1, rough(60)), with_error(8));
  for (const int z : {13, 12, 11}) EXPECT_LE(border_density(promised, z), 1.5) << "level " << z;
}

}  // namespace
}  // namespace cordillera::whole
