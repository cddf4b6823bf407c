// Blocks that share sides: each made from its own samples and three rows beyond, never from another block, and yet they fit.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string_view>

#include "gpu/exact/side_chain.h"
#include "tests/gpu/exact_laws.h"

namespace cordillera::gpu::exact {
namespace {

constexpr int kCells = 128, kTileSide = 32;  ///< of a block; of a tile

/// Four blocks of a square world, 2 x 2; outside of it is nothing.
struct World {
  proto::Samples samples;
  std::vector<Block> blocks;

  explicit World(proto::Samples of) : samples(std::move(of)) {
    const auto kind = [](bool shared) { return shared ? SideKind::shared : SideKind::outer; };
    for (int y = 0; y < 2; ++y) {
      for (int x = 0; x < 2; ++x) {
        blocks.push_back({&samples,
                          samples.west + x * kCells,
                          samples.south + y * kCells,
                          kCells + 1,
                          kCells + 1,
                          {kind(y == 1), kind(x == 0), kind(y == 0), kind(x == 1)}});
      }
    }
  }
  World(const World&) = delete;
};

proto::Samples world_of(const std::string& terrain) {
  return made_samples(terrain, {-kCells, -kCells, 2 * kCells + 1, 2 * kCells + 1});
}

struct AtVertex {
  std::set<std::int64_t> heights;  ///< with the label
  int triangles = 0, blocks = 0;
};
/// What blocks have on their common sides, by place.
std::map<std::pair<int, int>, AtVertex> common_sides(const World& world, const std::vector<std::vector<BlockMesh>>& meshes,
                                                     std::size_t level) {
  std::map<std::pair<int, int>, AtVertex> common;
  for (std::size_t b = 0; b < meshes.size(); ++b) {
    const BlockMesh& mesh = meshes[b][level];
    std::vector<int> triangles(mesh.vertices(), 0);
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t v : triangle) ++triangles[v];
    }
    for (std::size_t v = 0; v < mesh.vertices(); ++v) {
      const int x = static_cast<int>(world.blocks[b].west) + mesh.x[v], y = static_cast<int>(world.blocks[b].south) + mesh.y[v];
      if (x != 0 && y != 0) continue;
      AtVertex& at = common[{x, y}];
      at.heights.insert(2 * std::int64_t{mesh.height[v]} + mesh.is_void[v]);
      at.triangles += triangles[v];
      ++at.blocks;
    }
  }
  return common;
}

class ExactBorders : public testing::TestWithParam<std::pair<const char*, double>> {};

TEST_P(ExactBorders, FitWithoutSeeingEachOther) {
  const auto& [terrain, tolerance_m] = GetParam();
  const World world(world_of(terrain));
  const BlockPlan plan = plan_of(tolerance_m, 3, kTileSide);
  const auto meshes = simplified(world.blocks, plan);
  for (std::size_t b = 0; b < world.blocks.size(); ++b) {
    SCOPED_TRACE("block " + std::to_string(b));
    // Strips along shared sides are made anew on each level: between a comb's teeth there are a few triangles more.
    expect_laws(world.blocks[b], plan, meshes[b], std::string_view(terrain) == "comb" ? 1.02 : 1);
  }
  for (std::size_t l = 0; l < plan.levels.size(); ++l) {
    const auto common = common_sides(world, meshes, l);
    for (const auto& [place, at] : common) {
      const bool end = std::abs(place.first) == kCells || std::abs(place.second) == kCells;
      EXPECT_EQ(at.heights.size(), 1u) << "level " << l << ", " << place.first << ", " << place.second;
      EXPECT_EQ(at.blocks, place.first == 0 && place.second == 0 ? 4 : 2)
          << "level " << l << ", " << place.first << ", " << place.second;
      EXPECT_LE(at.triangles, end ? 13 : 14) << "level " << l << ", " << place.first << ", " << place.second;
    }
    EXPECT_GE(common.size(), 5u);
  }
}

TEST_P(ExactBorders, TakeNothingFromBeyondThreeRows) {
  const auto& [terrain, tolerance_m] = GetParam();
  const World world(world_of(terrain));
  proto::Samples other = world.samples;
  for (int y = -kCells; y <= kCells; ++y) {
    for (int x = -kCells; x <= kCells; ++x) {
      if (x <= kSideReach && y <= kSideReach) continue;  // the first block, and what it may see
      other.height[static_cast<std::size_t>(y + kCells) * static_cast<std::size_t>(other.columns) +
                   static_cast<std::size_t>(x + kCells)] =
          static_cast<std::int32_t>(bench::mixed(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 3) % 1000000);
    }
  }
  const World changed(std::move(other));
  const BlockPlan plan = plan_of(tolerance_m, 3, kTileSide);
  const auto before = simplified({world.blocks.data(), 1}, plan), after = simplified({changed.blocks.data(), 1}, plan);
  EXPECT_EQ(hash_of(before[0], world.blocks[0], plan), hash_of(after[0], changed.blocks[0], plan));
}

INSTANTIATE_TEST_SUITE_P(Made, ExactBorders,
                         testing::Values(std::pair{"alpine", 5.0}, std::pair{"rolling", 2.0}, std::pair{"city", 2.0},
                                         std::pair{"islands", 3.0}, std::pair{"noise", 5.0}, std::pair{"plane", 0.1},
                                         std::pair{"comb", 1.0}, std::pair{"cliff", 1.0}, std::pair{"sparse", 3.0},
                                         std::pair{"void", 3.0}, std::pair{"shore", 3.0}),
                         [](const auto& test) { return std::string(test.param.first); });

TEST(ExactBorder, ThreadsDoNotShow) {
  const World world(world_of("alpine"));
  const BlockPlan plan = plan_of(3, 3, kTileSide);
  const auto together = simplified(world.blocks, plan, three_threads());
  for (std::size_t b = 0; b < 4; ++b) {
    const auto alone = simplified({&world.blocks[b], 1}, plan);
    EXPECT_EQ(hash_of(together[b], world.blocks[b], plan), hash_of(alone[0], world.blocks[b], plan));
  }
}

TEST(ExactBorder, BadSidesAreNamed) {
  const World world(world_of("plane"));
  const auto parameter = [&](Block block) {
    const auto result = (*make_block_simplifier("cpu"))->simplify({&block, 1}, plan_of(1, 2, kTileSide));
    return result.ok() ? std::string() : result.problem().parameter;
  };
  Block block = world.blocks[0];
  EXPECT_EQ(parameter(block), "");
  block.sides[kWest] = SideKind::shared;  // nothing lies there
  EXPECT_EQ(parameter(block), "blocks[0].sides");
  block = world.blocks[0];
  block.columns -= 5;  // no tile ends there
  EXPECT_EQ(parameter(block), "blocks[0].sides");
}

}  // namespace
}  // namespace cordillera::gpu::exact
