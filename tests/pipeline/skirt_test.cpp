// How deep skirts hang: as deep as a neighbour of another level may be, and no deeper than terrain can.
#include <gtest/gtest.h>

#include <cmath>

#include "pipeline/build/tile_output.h"
#include "pipeline/encode/decode.h"
#include "pipeline/encode/region.h"
#include "pipeline/encode/tile_glb.h"
#include "tests/pipeline/encode_synthetic.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;

const proto::Lattice kLattice{9};
constexpr proto::TileAddress kTile{7, 200, 75};  // 156 km high
constexpr double kBeyond_m = 500, kRounding_m = 8 * 0.125;

/// How far the skirts hang below the lowest point of the terrain, as decoded; none without skirts.
std::optional<double> depth_m(const Heights& heights, double chain_tolerance_m, double error_m = 10,
                              unsigned coarsest_level = 0) {
  proto::LevelPlan level;
  level.set_level(7);
  level.set_ecef_step(0.125);
  level.set_chain_tolerance(chain_tolerance_m);
  LevelContext context{&kLattice, &level};
  BuiltTile built;
  built.tile = kTile;
  built.mesh = synthetic_mesh(kLattice, kTile, 32, heights);
  built.max_error_m = error_m;
  proto::BuildOptions options;
  options.set_min_level(coarsest_level);
  const auto encoded = encode_tile(context, built, options);
  EXPECT_TRUE(encoded);
  proto::Plan plan;
  plan.set_finest_level(static_cast<std::uint32_t>(kLattice.finest_level));
  *plan.add_levels() = level;
  *plan.mutable_options() = options;
  const auto made = tile_glb(plan, encoded->record, encoded->drc);
  EXPECT_TRUE(made.ok());
  const auto glb = decode_glb(*made);
  EXPECT_TRUE(glb.ok());
  double top = INFINITY, bottom = INFINITY;
  for (const proto::Vec3& p : glb->points) top = std::min(top, geodetic(p).height_m);
  for (const proto::Vec3& p : glb->skirt_points) bottom = std::min(bottom, geodetic(p).height_m);
  EXPECT_LE(encoded->record.region(4), std::min(top, bottom)) << "the region holds the skirts";
  EXPECT_GT(encoded->record.region(4), std::min(top, bottom) - 1000) << "and little else";
  if (glb->skirt_points.empty()) return std::nullopt;
  return top - bottom;
}

Heights flat(double height_m) {
  return [=](std::int64_t, std::int64_t) { return height_m; };
}
/// 1000 m from west to east.
std::optional<double> slope(std::int64_t i, std::int64_t) {
  return static_cast<double>(i - kLattice.west(kTile)) / static_cast<double>(kLattice.tile_units(7)) * 1000;
}

TEST(Skirts, CoverWhatBorderChainsMayBeApart) {
  EXPECT_NEAR(*depth_m(flat(700), 10), 40 + kRounding_m, 0.5);
  EXPECT_NEAR(*depth_m(flat(700), 100), 400 + kRounding_m, 0.5) << "a flat tile may have a rough neighbour";
  EXPECT_NEAR(*depth_m(flat(700), 100, 10, 6), 300 + kRounding_m, 0.5) << "one level is coarser";
  EXPECT_NEAR(*depth_m(flat(700), 100, 10, 7), 200 + kRounding_m, 0.5) << "none is";
}

TEST(Skirts, AreNoDeeperThanTerrainCanBe) {
  EXPECT_NEAR(*depth_m(flat(700), 12000), kBeyond_m + kRounding_m, 0.5);
  const double error_m = 200;
  EXPECT_NEAR(*depth_m(slope, 12000, error_m), 4 * error_m + kRounding_m, 1) << "below the lowest, wherever it hangs";
  const double side_m = M_PI / 128 * proto::kSemiMajor_m, sag_m = side_m * side_m / (2 * proto::kSemiMajor_m);
  EXPECT_NEAR(*depth_m(slope, 12000, 1e6), sag_m + kRounding_m, 0.02 * sag_m)
      << "an error beyond what the data's extent can give";
}

TEST(Skirts, OfDataThatReachesNoSideAreNone) {
  const Heights inside = [](std::int64_t i, std::int64_t j) -> std::optional<double> {
    const std::int64_t x = i - kLattice.west(kTile), y = j - kLattice.south(kTile);
    return x > 200 && x < 800 && y > 200 && y < 800 ? std::optional(700.0) : std::nullopt;
  };
  EXPECT_FALSE(depth_m(inside, 12000));
}

}  // namespace
}  // namespace cordillera::pipeline
