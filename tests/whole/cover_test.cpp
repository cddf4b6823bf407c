// What is well inside the data is shown: rims that run beside the sides of tiles, where a triangle on a long edge of a side had
// the void for its third corner. And where data is so narrow that none of it is well inside, the notes say so.
#include <gmock/gmock.h>

#include <cmath>

#include "pipeline/store/levels_shown.h"
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
  EXPECT_THAT(built.manifest.notes(), IsEmpty()) << "holes and outlines are no strips";
}

/// The share of the samples that a triangle of the level covers.
double share_covered(const Built& built, int level) {
  constexpr std::int64_t kStride = 3;
  double all = 0, shown = 0;
  for (std::int64_t j = built.samples.south; j < built.samples.south + built.samples.rows; j += kStride) {
    for (std::int64_t i = built.samples.west; i < built.samples.west + built.samples.columns; i += kStride) {
      if (!built.truth(i, j)) continue;
      ++all;
      shown += covered(built, level, i, j) ? 1 : 0;
    }
  }
  return shown / all;
}

/// A survey along a line that is twice so wide: in one block, or in several with levels above them, which do not have what the
/// blocks left out.
Built built_along_line(const std::string& strategy, double half_wide, std::int64_t block_samples) {
  proto::BuildOptions options = with_error(20);
  options.set_strategy(strategy);
  const auto band = [half_wide, ground = rough(23)](int c, int r) {
    return std::abs(r - 60 - 0.6 * c) < half_wide ? 0.05 * ground(c, r) : kNoData;
  };
  return build_dem(points_of(kCorner, 1300, 900, band), options, block_samples);
}
constexpr std::int64_t kOneBlock = 0, kSeveralBlocks = 2 * kTile * kTile;

TEST_P(Cover, of_a_narrow_band_is_told) {
  for (const std::int64_t block_samples : {kOneBlock, kSeveralBlocks}) {
    const Built built = built_along_line(GetParam(), 2, block_samples);
    const int last = pipeline::last_sparse_level(built.manifest).value_or(-1);
    if (block_samples == kSeveralBlocks) {
      EXPECT_THAT(built.manifest.notes(), testing::ElementsAre(testing::AllOf(
                                              testing::StartsWith("levels 0 to " + std::to_string(last) + " show less than half"),
                                              testing::EndsWith("where rims may move by one"))));
      EXPECT_GE(last, 0);
      EXPECT_LT(last, built.lattice.finest_level);
    } else {
      EXPECT_EQ(last, -1) << "one block keeps more of it";
      EXPECT_THAT(built.manifest.notes(), IsEmpty());
    }
    for (const proto::LevelSummary& level : built.manifest.levels()) {
      const int z = static_cast<int>(level.level());
      EXPECT_EQ(level.shown_share() < 0.5, z <= last) << z;
      if (z <= last) { EXPECT_LT(share_covered(built, z), 0.5) << z; }
    }
  }
}

/// Rims move less where otherwise such a band would go.
TEST_P(Cover, of_a_band_stays_on_all_levels) {
  for (const std::int64_t block_samples : {kOneBlock, kSeveralBlocks}) {
    const Built built = built_along_line(GetParam(), 9, block_samples);
    EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty());
    EXPECT_THAT(built.manifest.notes(), IsEmpty());
    for (const auto& [z, level] : built.levels) EXPECT_GT(share_covered(built, z), 0.5) << z;
  }
}

INSTANTIATE_TEST_SUITE_P(whole, Cover, testing::Values("cleap", "exact"));

}  // namespace
}  // namespace cordillera::whole
