#pragma once
// What tests of levels above exact blocks have in common.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <numbers>

#include "tests/whole/judge.h"

namespace cordillera::whole {

inline constexpr std::int64_t kSmallBlock = 513 * 513;

/// Rough ground with holes across the sides of blocks, and noise of holes. From column 1400 to `east` there is nothing but an
/// island around a pixel. For points_of(kHoleyCorner, …).
inline constexpr Corner kHoleyCorner{13, 4500 * 2 * kTile - 350, 3000 * 2 * kTile + 300};
inline HeightOf holey_ground(int east, int island_c, int island_r) {
  return [=, ground = rough(4), gaps = rough(9)](int c, int r) {
    const bool hole = std::hypot(c - 350, r - 280) < 40 || (c > 900 && c < 1400 && gaps(3 * c, 3 * r) > 900);
    return hole || (c > 1400 && c < east && std::hypot(c - island_c, r - island_r) > 90) ? kNoData : ground(c, r);
  };
}

/// Every level within its target: measured in blocks, a bound above them.
inline void expect_promise_above_blocks(const Built& built) {
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
    EXPECT_EQ(level.composed(), level.level() < built.plan.block_level()) << "level " << level.level();
  }
}

/// What is wrong with tiles so wide that to look for every sample's cover would take minutes.
inline Findings judge_wide(const Built& built) {
  Findings found = judge_plans(built);
  for (const Findings& more : {judge_neighbours(built), judge_errors(built, {500, 0})})
    found.insert(found.end(), more.begin(), more.end());
  return found;
}

/// Hills of all sizes that go around without a seam, and a lake without data on the antimeridian.
inline double earth_with_a_lake(double lon, double lat) {
  const double x = std::cos(lat) * std::cos(lon), y = std::cos(lat) * std::sin(lon), z = std::sin(lat);
  if (std::hypot(x + 1, y, z - 0.1) < 0.1) return kNoData;
  double height = 0, scale = 3, relief = 1500;
  for (int k = 0; k < 9; ++k, scale *= 2.1, relief *= 0.6)
    height += relief * std::sin(scale * x + k) * std::cos(scale * y + 2 * k) * std::cos(scale * z);
  return height;
}

/// Pixels of all of the circle, rows of them from north to south.
inline Dem all_around(int columns, int rows, double north_deg) {
  const double pixel_deg = 360.0 / columns;
  Dem dem;
  dem.columns = columns;
  dem.rows = rows;
  dem.geotransform = {-180, pixel_deg, 0, north_deg, 0, -pixel_deg};
  dem.height = [=](int c, int r) {
    constexpr double kDegree = std::numbers::pi / 180;
    return earth_with_a_lake((-180 + (c + 0.5) * pixel_deg) * kDegree, (north_deg - (r + 0.5) * pixel_deg) * kDegree);
  };
  return dem;
}

}  // namespace cordillera::whole
