// Which tiles a plan's window touches.
#include "pipeline/plan/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace cordillera::pipeline {
namespace {

using proto::TileAddress;

proto::Plan plan_with(int finest_level, std::array<std::int64_t, 4> window) {
  proto::Plan plan;
  plan.set_scheme("geodetic");
  plan.set_finest_level(static_cast<std::uint32_t>(finest_level));
  for (const std::int64_t side : window) plan.add_window(static_cast<std::int32_t>(side));
  return plan;
}

/// By the definition: the closed rectangle of the tile meets the closed window, in some turn.
bool touches(const proto::Plan& plan, const TileAddress& tile) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t size = lattice.tile_units(tile.z);
  if (lattice.south(tile) > plan.window(3) || lattice.south(tile) + size < plan.window(1)) return false;
  for (int turn = -1; turn <= 1; ++turn) {
    const std::int64_t west = lattice.west(tile) + turn * lattice.columns();
    if (west <= plan.window(2) && west + size >= plan.window(0)) return true;
  }
  return false;
}

TEST(TouchedTiles, AreThoseWhoseClosedRectangleMeetsTheWindow) {
  std::mt19937 random(3);
  constexpr int kFinest = 4;
  const proto::Lattice lattice{kFinest};
  for (int round = 0; round < 60; ++round) {
    // Some end on a tile's side, some go on beyond the antimeridian, one goes around.
    const std::int64_t grain = round % 3 == 0 ? 256 : 1;
    const auto at = [&](std::int64_t below) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(below / grain)) * grain;
    };
    const std::int64_t west = at(lattice.columns()), south = at(lattice.rows());
    const std::int64_t east = round == 59 ? west + lattice.columns() : west + at(lattice.columns());
    const proto::Plan plan = plan_with(kFinest, {west, south, east, std::min(lattice.rows(), south + at(lattice.rows()))});
    for (int z = 0; z <= kFinest; ++z) {
      std::vector<TileAddress> wanted;
      for (std::int32_t y = 0; y < proto::tiles_up(z); ++y)
        for (std::int32_t x = 0; x < proto::tiles_across(z); ++x)
          if (touches(plan, {z, x, y})) wanted.push_back({z, x, y});
      EXPECT_EQ(touched_tiles(plan, z), wanted) << "window " << west << ' ' << south << ' ' << east << ", level " << z;
      const TileAddress node{1, 3, 0};
      if (z < node.z) continue;
      std::erase_if(wanted, [&](const TileAddress& t) { return (t.x >> (z - 1)) != node.x || (t.y >> (z - 1)) != node.y; });
      EXPECT_EQ(touched_tiles(plan, z, node), wanted);
    }
  }
}

TEST(TouchedTiles, OfANodeAreNotLookedForInTheWholeLevel) {
  // The whole earth at level 20: its finest level has 2^41 tiles, which nobody could list.
  const proto::Lattice lattice{20};
  const proto::Plan plan = plan_with(20, {0, 0, lattice.columns(), lattice.rows()});
  EXPECT_EQ(touched_tiles(plan, 20, {16, 70000, 30000}).size(), 256U);
}

}  // namespace
}  // namespace cordillera::pipeline
