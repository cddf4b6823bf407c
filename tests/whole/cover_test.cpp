// What is well inside the data is shown: rims that run beside the sides of tiles, where a triangle on a long edge of a side had
// the void for its third corner.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

constexpr std::int64_t kTile = proto::kTileCells;

/// Bays and needles along the sides of four tiles, which meet in the pixel (300, 200), and an outline that crosses them aslant.
HeightOf ragged() {
  return [ground = rough(17)](int c, int r) {
    const int from_column = std::abs(c - 300), from_row = std::abs(r - 200);
    const bool bay = (from_column == 1 + r % 3 && r / 7 % 5 == 2) || (from_row == 1 + c % 2 && c / 11 % 4 == 1);
    const bool beyond = c > 330 + 0.53 * r;
    return bay || beyond ? kNoData : 0.05 * ground(c, r);
  };
}

class Cover : public testing::TestWithParam<const char*> {};
TEST_P(Cover, is_whole_beside_sides) {
  const Corner corner{12, 2000 * kTile - 300, 1300 * kTile + 200};
  proto::BuildOptions options = with_error(20);
  options.set_strategy(GetParam());
  const Built built = build_dem(points_of(corner, 560, 400, ragged()), options);
  EXPECT_THAT(judge_cover(built), IsEmpty());
  EXPECT_THAT(judge_plans(built), IsEmpty());
}
INSTANTIATE_TEST_SUITE_P(whole, Cover, testing::Values("waves", "exact"));

}  // namespace
}  // namespace cordillera::whole
