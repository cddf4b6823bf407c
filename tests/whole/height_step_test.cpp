// Heights of .drc tiles are kept to a step that the level's target can bear, and each tile says to which.
#include <gmock/gmock.h>

#include <cmath>

#include "pipeline/encode/draco_mesh.h"
#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;

Built rough_ground(const proto::BuildOptions& options) {
  const auto height = [](int c, int r) {
    return 700 + 90 * std::sin(0.11 * c) * std::cos(0.07 * r) + 12 * std::sin(0.9 * c + 1.3 * r) + 0.013 * c;
  };
  return build_dem(points_of({13, 9000 * proto::kTileCells + 40, 6000 * proto::kTileCells + 300}, 301, 281, height), options);
}

/// A power of two up to an eighth of the target, but no less than a millimetre and no more than 4 m.
void expect_steps(const Built& built) {
  for (const proto::LevelSummary& level : built.manifest.levels()) {
    const double step_m = level.height_step(), most_m = std::min(level.tolerance() / 8, 4.0);
    EXPECT_EQ(std::exp2(std::round(std::log2(step_m))), step_m) << "level " << level.level();
    EXPECT_TRUE(step_m == 1.0 / 1024 ? most_m < 2.0 / 1024 : step_m <= most_m && most_m < 2 * step_m)
        << "level " << level.level() << ": " << step_m;
    const auto steps = static_cast<std::int32_t>(std::lround(step_m * 1024));
    for (const auto& [at, tile] : built.levels.at(static_cast<int>(level.level()))) {
      for (const std::int32_t h : tile.drc.h) ASSERT_EQ(h % steps, 0) << "level " << at.z;
    }
  }
}

TEST(height_step, follows_the_target_and_the_error_is_stated_with_it) {
  for (const double error_m : {0.05, 2.0, 9.0}) {
    const Built built = rough_ground(with_error(error_m));
    expect_steps(built);
    EXPECT_THAT(judge(built, kAllSamples), IsEmpty()) << error_m;
    for (const proto::LevelSummary& level : built.manifest.levels())
      EXPECT_LE(level.stated_max_error(), level.target()) << "level " << level.level();
  }
}

TEST(height_step, of_heights_that_quality_moves) {
  proto::BuildOptions options = with_error(4);
  options.set_quality("best");
  const Built built = rough_ground(options);
  expect_steps(built);
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
}

// A fiftieth of no relief, and a 64th of a cell of 15 cm, are less than four steps of a millimetre, which an exact block takes.
TEST(height_step, of_still_ground_in_the_finest_pixels_is_within_the_least_error) {
  const auto height = [](int, int) { return 2495.0; };
  proto::BuildOptions options = plain_options();
  options.set_strategy("auto");
  const Built built = build_dem(points_of({19, 300000 * kTile, 200000 * kTile}, 60, 50, height), options);
  EXPECT_EQ(built.manifest.options().strategy(), "exact");
  EXPECT_EQ(built.manifest.levels(0).target(), 0.01);
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
}

TEST(height_step, of_a_share_follows_the_tolerance_that_gives_it) {
  proto::BuildOptions options = plain_options();
  for (const double share : {0.5, 0.1}) options.add_keep(share);
  expect_steps(rough_ground(options));
}

TEST(height_step, is_what_makes_tiles_small) {
  const Built built = rough_ground(with_error(2));
  std::size_t coarse = 0, fine = 0;
  for (const auto& [at, tile] : built.finest()) {
    pipeline::LatticeMesh mesh;
    for (std::size_t v = 0; v < tile.drc.h.size(); ++v) mesh.points.push_back({tile.drc.u[v], tile.drc.v[v], tile.drc.h[v]});
    mesh.triangles = tile.drc.triangles;
    mesh.side = tile.drc.side;
    mesh.height_step = 1.0 / 1024;
    fine += pipeline::draco_encode(mesh).size();
    coarse += tile.record.drc_bytes();
  }
  EXPECT_LT(coarse, fine) << "the same heights in millimetres";
}

}  // namespace
}  // namespace cordillera::whole
