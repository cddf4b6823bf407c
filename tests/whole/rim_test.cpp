// Rims above the blocks: samples are out of reach there, and a coarse triangle may cover what finer surfaces left out.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

constexpr unsigned kBlockLevel = 10;  // of a raster that is larger than one block
constexpr std::int64_t kBlock = 4 * proto::kTileCells;

/// A hill with a rim of many bays, and before it pillars of single samples, which no triangle stands on: as the bays close on the
/// way up, triangles come to lie over pillars. Around the corner of four blocks, which is the pixel (2500, 1700); nothing else
/// has data.
HeightOf bays_and_pillars() {
  const HeightOf ground = rough(31);
  return [=](int c, int r) {
    const double x = c - 2500, y = r - 1700, angle = std::atan2(y, x);
    const double from_rim = 230 + 14 * std::sin(47 * angle) + 9 * std::sin(101 * angle) - std::hypot(x, y);
    if (from_rim > 0) return 0.1 * ground(c, r);
    return from_rim > -30 && c % 11 == 2 && r % 9 == 1 ? 700.0 : kNoData;
  };
}

TEST(rim, a_promise_holds_above_the_blocks_too) {
  const Corner corner{12, 324 * kBlock - 2500, 796 * kBlock + 1700};
  const Built built = build_dem(points_of(corner, 5000, 3500, bays_and_pillars()), plain_options());
  ASSERT_EQ(built.plan.block_level(), kBlockLevel);
  EXPECT_THAT(judge(built, {20000, 0}), IsEmpty());
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
    EXPECT_EQ(level.composed(), level.level() < kBlockLevel) << "level " << level.level();
    if (level.level() >= kBlockLevel) { EXPECT_GT(level.uncovered_samples(), 0) << "level " << level.level(); }
  }
}

}  // namespace
}  // namespace cordillera::whole
