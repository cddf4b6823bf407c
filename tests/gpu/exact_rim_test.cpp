// Rims that may not move, and rows that are narrow: what is different there on the finest level and beside a pole.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "gpu/exact/side_chain.h"
#include "gpu/exact/steps/triangle.h"
#include "tests/gpu/exact_laws.h"

namespace cordillera::gpu::exact {
namespace {

using HeightOf = std::function<std::int32_t(int, int)>;

/// 129 x 129 samples, sides of tiles every 64.
struct Ground {
  static constexpr int kSide = 129, kTileSide = 64;
  proto::Samples samples{0, 0, kSide, kSide, {}, {}};
  std::vector<CurveRow> curve;

  explicit Ground(const HeightOf& height) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) samples.height.push_back(height(x, y));
    }
  }
  /// Its first row is the south pole's.
  void put_at_pole() {
    for (int y = 0; y < kSide; ++y) {
      const double cell_rad = std::numbers::pi / 2 / (8 * kSide), sway = 3.0 / 8 / std::max(y, 1);
      curve.push_back({0.1f, static_cast<float>(sway), static_cast<float>(std::sin(y * cell_rad)), y});
    }
    std::fill_n(samples.height.begin(), kSide, samples.at(0, 0));
  }
  Block block() const {
    Block all = whole(samples);
    all.curve = curve;
    all.curve_up = curve.empty() ? 0 : 0.1f;
    return all;
  }
};

/// Rims stay where they are on the finest level.
BlockPlan strict_plan(double tolerance_m, int levels) {
  BlockPlan plan = plan_of(tolerance_m, levels, Ground::kTileSide);
  for (std::size_t l = 0; l < plan.levels.size(); ++l) plan.levels[l].rim_reach = static_cast<int>(l) - 1;
  return plan;
}

std::vector<BlockMesh> made(const Ground& ground, const BlockPlan& plan) {
  const Block block = ground.block();
  return simplified({&block, 1}, plan)[0];
}

std::size_t published(const BlockMesh& mesh) {
  return static_cast<std::size_t>(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    return !mesh.is_void[t[0]] && !mesh.is_void[t[1]] && !mesh.is_void[t[2]];
  }));
}

std::int32_t hill(int x, int y) {
  return static_cast<std::int32_t>(1024 * (40 + 0.004 * x * y + 9 * std::sin(0.07 * x + 0.05 * y)));
}

TEST(ExactRim, StraightOnesNeedFewVertices) {
  const Ground flat([](int x, int y) { return x >= 9 && x <= 117 && y >= 21 && y <= 99 ? 7168 : proto::kNoHeight; });
  const std::vector<BlockMesh> levels = made(flat, strict_plan(1, 2));
  EXPECT_LE(published(levels[0]), 24u) << "four tiles with a corner each";
  EXPECT_GE(published(levels[0]), 8u);
}

// What is narrower than 64 samples keeps its outline on all levels.
TEST(ExactRim, StraightOnesNeedFewVerticesWhereTheyNeverMove) {
  const Ground flat([](int x, int y) { return x >= 9 && x <= 117 && y >= 21 && y <= 99 ? 7168 : proto::kNoHeight; });
  BlockPlan plan = strict_plan(1, 3);
  for (BlockLevel& level : plan.levels) level.rim_reach = -1;
  for (const BlockMesh& mesh : made(flat, plan)) EXPECT_LE(published(mesh), 24u);
}

TEST(ExactRim, TheSmallestGroundStays) {
  // A triangle with a line of samples, which shows nothing.
  const Ground small([](int x, int y) { return (y == 9 && x >= 8 && x <= 10) || (x == 8 && y == 10) ? 2048 : proto::kNoHeight; });
  EXPECT_EQ(published(made(small, strict_plan(1, 1))[0]), 1u);
}

class ExactRims : public testing::TestWithParam<std::string> {
 protected:
  static Ground ground() {
    const auto random = [](int x, int y) {
      return bench::mixed(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 5);
    };
    if (GetParam() == "strips") {
      return Ground([](int x, int y) { return (x + y / 3) % 9 < 2 || (y + x / 7) % 13 < 3 ? hill(x, y) : proto::kNoHeight; });
    }
    if (GetParam() == "holes")
      return Ground([=](int x, int y) { return random(x / 5, y / 5) % 5 ? hill(x, y) : proto::kNoHeight; });
    if (GetParam() == "askew")
      return Ground([](int x, int y) { return 3 * x + y > 60 && 5 * y < 2 * x + 400 ? hill(x, y) : proto::kNoHeight; });
    return Ground([](int x, int y) { return std::hypot(x - 60, y - 66) < 50 ? hill(x, y) : proto::kNoHeight; });
  }
};

/// The judge's cell of the finest level is one sample; voids are shown nowhere.
TEST_P(ExactRims, ShowWhatTheyShouldAndNothingElse) {
  const Ground all = ground();
  const BlockPlan plan = strict_plan(2, 3);
  const std::vector<BlockMesh> levels = made(all, plan);
  const Block block = all.block();
  for (std::size_t l = 0; l < levels.size(); ++l) {
    SCOPED_TRACE("level " + std::to_string(l));
    const Verdict verdict = Judge(block, plan, l).judge(levels[l], Measure::samples);
    EXPECT_LE(verdict.max_m, plan.levels[l].tolerance_m);
    expect_sound(verdict);
  }
  for (const auto& t : levels[0].triangles) {
    if (levels[0].is_void[t[0]] || levels[0].is_void[t[1]] || levels[0].is_void[t[2]]) continue;
    const auto corner = [&](std::size_t k) { return Corner{levels[0].x[t[k]], levels[0].y[t[k]], 0, false}; };
    const Triangle triangle = make_triangle(corner(0), corner(1), corner(2), {1, -1, {}});
    for (int y = triangle.south; y <= triangle.north; ++y) {
      for (int x = triangle.west; x <= triangle.east; ++x)
        EXPECT_FALSE(triangle.covers(x, y) && all.samples.at(x, y) == proto::kNoHeight) << x << ", " << y;
    }
  }
}

TEST_P(ExactRims, CudaGivesTheSame) {
  auto simplifier = make_block_simplifier("cuda");
  if (!simplifier.ok()) GTEST_SKIP() << simplifier.problem().line();
  for (const bool at_pole : {false, true}) {
    Ground all = ground();
    if (at_pole) all.put_at_pole();
    const BlockPlan plan = strict_plan(2, 4);
    const Block block = all.block();
    const auto result = (*simplifier)->simplify({&block, 1}, plan);
    ASSERT_TRUE(result.ok()) << result.problem().line();
    EXPECT_EQ(hash_of((*result)[0], block, plan), hash_of(made(all, plan), block, plan));
  }
}
INSTANTIATE_TEST_SUITE_P(Made, ExactRims, testing::Values("strips", "holes", "askew", "disc"),
                         [](const auto& test) { return test.param; });

TEST(ExactPole, IsOneHeightAndMeridiansEndAtDoublingDistances) {
  Ground ground([](int x, int y) { return hill(x, y) + static_cast<std::int32_t>(700 * ((x * 7 + y * 3) % 5)); });
  ground.put_at_pole();
  const BlockPlan plan = strict_plan(6, 3);
  Block block = ground.block();
  const auto levels = simplified({&block, 1}, plan)[0];
  for (std::size_t l = 0; l < levels.size(); ++l) {
    std::set<std::int32_t> heights;
    std::set<int> on_meridian;
    for (std::size_t v = 0; v < levels[l].vertices(); ++v) {
      if (levels[l].y[v] == 0) heights.insert(levels[l].height[v]);
      if (levels[l].x[v] == Ground::kTileSide) on_meridian.insert(levels[l].y[v]);
    }
    EXPECT_EQ(heights.size(), 1u) << "level " << l;
    if (l > 0) continue;  // there it is no side of a tile
    for (const int to_pole : {1, 2, 4, 8, 16, 32, 64}) EXPECT_TRUE(on_meridian.contains(to_pole)) << to_pole;
  }
}

SideSamples side_of(const HeightOf& height) {
  SideSamples samples;
  for (int r = 0; r < SideSamples::kRows; ++r) {
    for (int s = 0; s <= 256; ++s) samples.row[static_cast<std::size_t>(r)].push_back(height(r, s));
  }
  return samples;
}

// A raster that ends on a side that two blocks share.
TEST(ExactSideChain, GoesAlongARim) {
  const SideSamples samples = side_of([](int r, int) { return r <= kSideReach ? 4096 : proto::kNoHeight; });
  const LevelRules rules{.tolerance = 1024, .height_step = 64, .tile_side = 256};
  EXPECT_LE(coarser_chain(samples, finest_chain(samples), rules).place.size(), 3u);
  const SideSamples ragged = side_of([](int r, int s) { return r <= kSideReach || s % 2 ? 4096 : proto::kNoHeight; });
  EXPECT_EQ(coarser_chain(ragged, finest_chain(ragged), rules).place.size(), 257u);
}

TEST(ExactSideChain, LeavesAPoleItsHeight) {
  SideSamples samples = side_of([](int r, int s) { return r == kSideReach ? 600 : 600 + 300 * ((s / 8 + r) % 3); });
  const auto heights = [&] {
    SideChain chain = finest_chain(samples);
    std::set<std::int32_t> all;
    for (const float step : {64.f, 256.f, 1024.f}) {
      chain = coarser_chain(samples, chain, {.tolerance = 4 * step, .height_step = step, .tile_side = 256});
      all = {chain.height[kSideReach].begin(), chain.height[kSideReach].end()};
      if (all.size() > 1) break;
    }
    return all.size();
  };
  samples.on_pole = true;
  EXPECT_EQ(heights(), 1u);
  samples.on_pole = false;
  EXPECT_GT(heights(), 1u) << "other sides are fitted";
}

}  // namespace
}  // namespace cordillera::gpu::exact
