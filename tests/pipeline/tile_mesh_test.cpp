// Tiles above the blocks, bounded by composition: what they state is within the target, and they thin out as levels should.
#include "pipeline/tile/tile_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "pipeline/tile/mesh_record.h"

namespace cordillera::pipeline {
namespace {

using proto::TileAddress;
using Tiles = std::map<TileAddress, BuiltTile>;

constexpr int kFinest = 12, kTop = 10, kBlocks = 11;  // 4 x 4 finest tiles, blocks of 2 x 2
constexpr TileAddress kRoot{kTop, 322, 794};          // where fjords are

/// A fjord winds through mountains: its walls rise from the sea to 300 m within some samples.
double fjord_m(double x, double y) {
  const double from_middle = std::abs(x - 500 - 180 * std::sin(y / 260) - 50 * std::sin(y / 61)) - 80;
  if (from_middle <= 0) return 0;
  return std::min(from_middle / 24, 1.0) * 300 +
         std::min(from_middle / 300, 1.0) * (200 + 60 * std::sin(x / 43 + std::sin(y / 51)) * std::cos(y / 39));
}

class Composed : public testing::Test {
 protected:
  Composed() {
    const std::int64_t side = lattice_.tile_units(kTop);
    const auto across = static_cast<std::int32_t>(side + 1);
    samples_ = {lattice_.west(kRoot), lattice_.south(kRoot), across, across, {}, {}};
    for (std::int64_t y = 0; y <= side; ++y)
      for (std::int64_t x = 0; x <= side; ++x)
        samples_.height.push_back(
            static_cast<std::int32_t>(std::lround(1024 * fjord_m(static_cast<double>(x), static_cast<double>(y)))));
    for (int z = kFinest; z >= kTop; --z) {
      proto::LevelPlan& level = levels_[z];
      level.set_level(static_cast<std::uint32_t>(z));
      level.set_target(std::ldexp(9.54, kFinest - z));
      level.set_ecef_step(std::ldexp(1.0, kFinest - z - 4));
      level.set_chain_tolerance(0.6 * (level.target() * (z < kBlocks ? 0.5 : 1) - level.ecef_step()));
      level.set_rim_tolerance(0.5);
    }
  }

  LevelContext context(int z) const {
    LevelContext context{&lattice_, &levels_.at(z), true, z < kBlocks ? nullptr : &samples_};
    context.merges_above = z <= kBlocks && z > kTop;
    return context;
  }

  Tiles level(int z, const Tiles& below) const {
    const auto simplifier = gpu::make_simplifier("cpu").value();
    Tiles tiles;
    const int across = 1 << (z - kTop);
    for (int y = 0; y < across; ++y) {
      for (int x = 0; x < across; ++x) {
        const TileAddress tile{z, kRoot.x * across + x, kRoot.y * across + y};
        std::array<const BuiltTile*, 4> children{};
        for (int c = 0; c < 4 && z < kFinest; ++c) children[static_cast<std::size_t>(c)] = &below.at(tile.child(c));
        auto prepared = z == kFinest ? prepare_finest(context(z), tile) : prepare_parent(context(z), tile, children);
        tiles.emplace(tile, complete(context(z), *prepared, *simplifier));
      }
    }
    return tiles;
  }

  void expect_true(const BuiltTile& tile) {
    gpu::SurfaceErrorInput input;
    input.lattice = &lattice_;
    input.tile = tile.tile;
    input.mesh = &tile.mesh;
    input.samples = &samples_;
    input.ecef_steps = levels_[tile.tile.z].ecef_step();
    EXPECT_LE(gpu::surface_error(input, INFINITY).max_m, tile.max_error_m);
  }

  /// A stored tile brings its children's surface along.
  void expect_stored(const BuiltTile& tile) {
    ASSERT_TRUE(tile.finer);
    EXPECT_GT(tile.finer->mesh.triangles.size(), tile.mesh.triangles.size());
    EXPECT_LE(tile.finer->max_error_m, levels_[kFinest].target());
    const auto again = tile_from_bytes(tile.tile, to_bytes(tile));
    ASSERT_TRUE(again.ok());
    ASSERT_TRUE(again->finer);
    EXPECT_EQ(again->mesh.triangles, tile.mesh.triangles);
    EXPECT_EQ(again->finer->mesh.height, tile.finer->mesh.height);
    EXPECT_EQ(again->finer->mesh.triangles, tile.finer->mesh.triangles);
    EXPECT_EQ(again->finer->max_error_m, tile.finer->max_error_m);
  }

  proto::Lattice lattice_{kFinest};
  proto::Samples samples_;
  std::map<int, proto::LevelPlan> levels_;
};

std::size_t triangles(const Tiles& tiles) {
  std::size_t sum = 0;
  for (const auto& [at, tile] : tiles) sum += tile.mesh.triangles.size();
  return sum;
}

TEST_F(Composed, states_no_more_than_the_target_no_less_than_what_samples_show_and_thins_out) {
  Tiles below;
  std::size_t before = 0;
  for (int z = kFinest; z >= kTop; --z) {
    Tiles tiles = level(z, below);
    for (const auto& [at, tile] : tiles) {
      EXPECT_EQ(tile.composed, z < kBlocks);
      EXPECT_LE(tile.max_error_m, levels_[z].target()) << "level " << z << " tile " << at.x << " " << at.y;
      expect_true(tile);
      if (z == kBlocks) expect_stored(tile);
    }
    if (z < kFinest) { EXPECT_LE(4 * triangles(tiles), 3 * before) << "level " << z; }
    before = triangles(tiles);
    below = std::move(tiles);
  }
}

// A tile whose promise is broken is tried again; that one of the attempts leaves a border vertex that must go is no reason to
// settle for it.
TEST_F(Composed, A_broken_promise_outlives_an_attempt_that_fails_at_the_border) {
  const auto prepare = [&] {
    PreparedTile prepared = *prepare_finest(context(kFinest), {kFinest, kRoot.x * 4, kRoot.y * 4});
    prepared.best.emplace();
    prepared.best->max_error_m = 1e6;
    return prepared;
  };
  PreparedTile prepared = prepare();
  const proto::TileMesh uncollapsed = prepared.input;  // all that must go is still there
  ASSERT_TRUE(std::any_of(uncollapsed.mark.begin(), uncollapsed.mark.end(),
                          [](std::uint8_t mark) { return (mark & proto::kRemove) != 0; }));
  EXPECT_FALSE(finish(context(kFinest), prepared, uncollapsed, 3));
  ASSERT_TRUE(prepared.best);
  EXPECT_EQ(prepared.best->max_error_m, 1e6);
  BuiltTile built = complete(context(kFinest), prepared, *gpu::make_simplifier("cpu").value());
  EXPECT_LE(built.max_error_m, levels_[kFinest].target());
  // After so many attempts it is all that there is.
  prepared = prepare();
  const auto best = finish(context(kFinest), prepared, uncollapsed, 6);
  ASSERT_TRUE(best);
  EXPECT_EQ(best->max_error_m, 1e6);
}

TEST(MeshRecord, StepsThatLeaveEveryLatticeAreDamage) {
  proto::TileMeshRecord record;
  record.set_side(64);
  for (const std::int32_t step : {1, 2, 3, -1, 0, 1}) record.add_loose(step);
  EXPECT_TRUE(tile_from_bytes(kRoot, record.SerializeAsString()).ok());
  for (int k = 3; k < 6; ++k) {
    proto::TileMeshRecord far = record;
    far.set_loose(k, std::numeric_limits<std::int32_t>::max());
    EXPECT_EQ(tile_from_bytes(kRoot, far.SerializeAsString()).problem().type, "store-damaged") << k;
  }
}

}  // namespace
}  // namespace cordillera::pipeline
