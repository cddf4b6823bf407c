// Walls that rise from the sea within some samples, and data that ends on them: needles along a rim stand upright, and every
// rounding tilts them.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

/// Sea at 0 m beside cliffs of a thousand metres; the walls themselves have gaps, as radar leaves them.
HeightOf fjord() {
  const HeightOf ground = rough(70), gaps = rough(71);
  return [=](int c, int r) {
    const double from_middle = std::abs(c - 500 - 180 * std::sin(r / 150.0) - 40 * std::sin(r / 37.0)) - 90;
    if (from_middle <= 0) return 0.0;
    const double wall = std::min(from_middle / 30, 1.0) * 1100;
    if (from_middle < 40 && gaps(c, r) > 900) return kNoData;
    return wall + 0.4 * ground(c, r);
  };
}

TEST(fjord, walls_with_gaps_keep_the_default_promise_at_every_level) {
  proto::BuildOptions options = plain_options();
  const Built built = build_dem(points_of({12, 1288 * kTile + 40, 3183 * kTile + 90}, 1000, 900, fjord()), options);
  EXPECT_THAT(judge(built, {20000, 0}), IsEmpty());
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
  }
}

}  // namespace
}  // namespace cordillera::whole
