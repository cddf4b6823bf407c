// Levels above blocks: without samples the promise holds for every one of them, and little is lost for it.
#include <gtest/gtest.h>

#include "tests/gpu/exact_above.h"
#include "tests/gpu/exact_laws.h"

namespace cordillera::gpu::exact {
namespace {

constexpr std::size_t kBelow = 3, kLevels = 6;

std::vector<BlockMesh> above(const Block& block, const BlockPlan& plan, ParallelFor parallel = one_after_the_other) {
  const auto simplifier = make_block_simplifier("cpu", std::move(parallel));
  auto levels = simplified_above(**simplifier, block, plan, kBelow);
  EXPECT_TRUE(levels.ok()) << levels.problem().line();
  return levels.ok() ? std::move(*levels) : std::vector<BlockMesh>(plan.levels.size());
}

struct Case {
  const char* terrain;
  double tolerance_m;
  Window window;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.terrain; }

class ExactAbove : public testing::TestWithParam<Case> {};
TEST_P(ExactAbove, LawsHoldForEverySample) {
  const proto::Samples samples = made_samples(GetParam().terrain, GetParam().window);
  const Block block = whole(samples);
  const BlockPlan plan = plan_of(GetParam().tolerance_m, kLevels, 32);
  const std::vector<BlockMesh> levels = above(block, plan);
  for (std::size_t l = kBelow; l < levels.size(); ++l) {
    SCOPED_TRACE("level " + std::to_string(l));
    const Verdict verdict = Judge(block, plan, l).judge(levels[l], Measure::samples);
    EXPECT_LE(verdict.max_m, plan.levels[l].tolerance_m);
    expect_sound(verdict);
    ASSERT_EQ(levels[l].bound.size(), levels[l].triangles.size());
    double bound_m = 0;
    for (const float bound : levels[l].bound) bound_m = std::max(bound_m, bound * proto::kHeightStep_m);
    EXPECT_GE(bound_m, verdict.max_m) << "what is stated must not be less than what is";
    EXPECT_LE(bound_m, plan.levels[l].tolerance_m);
  }
}

/// With the samples at hand there would be hardly fewer.
TEST_P(ExactAbove, TrianglesAreNearlyThoseOfOnePiece) {
  const proto::Samples samples = made_samples(GetParam().terrain, GetParam().window);
  const Block block = whole(samples);
  const BlockPlan plan = plan_of(GetParam().tolerance_m, kLevels, 32);
  const std::vector<BlockMesh> levels = above(block, plan), piece = simplified({&block, 1}, plan)[0];
  for (std::size_t l = kBelow; l < levels.size(); ++l)
    EXPECT_LE(static_cast<double>(levels[l].triangles.size()), 1.15 * static_cast<double>(piece[l].triangles.size()) + 40)
        << "level " << l;
}
TEST_P(ExactAbove, CudaGivesTheSame) {
  const auto simplifier = make_block_simplifier("cuda");
  if (!simplifier.ok()) GTEST_SKIP() << simplifier.problem().line();
  const proto::Samples samples = made_samples(GetParam().terrain, GetParam().window);
  const Block block = whole(samples);
  const BlockPlan plan = plan_of(GetParam().tolerance_m, kLevels, 32);
  const auto levels = simplified_above(**simplifier, block, plan, kBelow);
  ASSERT_TRUE(levels.ok());
  EXPECT_EQ(hash_of(*levels, block, plan), hash_of(above(block, plan), block, plan));
}
INSTANTIATE_TEST_SUITE_P(Made, ExactAbove,
                         testing::Values(Case{"alpine", 5, {0, 0, 513, 385}}, Case{"rolling", 2, {640, -320, 257, 257}},
                                         Case{"city", 2, {0, 0, 193, 257}}, Case{"islands", 3, {0, 0, 513, 257}},
                                         Case{"noise", 5, {0, 0, 129, 129}}, Case{"cliff", 1, {0, 0, 193, 161}},
                                         Case{"sparse", 3, {0, 0, 193, 161}}, Case{"void", 3, {0, 0, 129, 129}}),
                         [](const auto& test) { return std::string(test.param.terrain); });

TEST(ExactAbove, ThreadsDoNotShow) {
  const proto::Samples samples = made_samples("islands", {0, 0, 513, 513});
  const Block block = whole(samples);
  const BlockPlan plan = plan_of(4, kLevels, 32);
  EXPECT_EQ(hash_of(above(block, plan), block, plan), hash_of(above(block, plan, three_threads()), block, plan));
}

TEST(ExactAbove, BadCallsAreNamed) {
  const proto::Samples samples = made_samples("plane", {0, 0, 33, 33});
  const Block block = whole(samples);
  const BlockPlan plan = plan_of(1, 1, 32);
  const auto simplifier = make_block_simplifier("cpu");
  Ground ground;
  ground.columns = ground.rows = 33;
  Watch watch;
  watch.squares = [&](std::size_t, Squares&& squares) { ground.squares = std::move(squares); };
  const auto made = (*simplifier)->simplify({&block, 1}, plan, watch);
  ASSERT_TRUE(made.ok());
  const BlockMesh& mesh = (*made)[0][0];
  const auto parameter = [&](const Ground& g, const BlockMesh& start) {
    const auto result = (*simplifier)->simplify_above(g, start, plan);
    return result.ok() ? std::string() : result.problem().type == "option-invalid" ? result.problem().parameter : "?";
  };
  EXPECT_EQ(parameter(ground, mesh), "");
  Ground bad = ground;
  bad.columns = 41;
  EXPECT_EQ(parameter(bad, mesh), "ground");
  bad = ground;
  bad.squares.code.pop_back();
  EXPECT_EQ(parameter(bad, mesh), "ground");
  BlockMesh torn = mesh;
  torn.triangles.pop_back();
  EXPECT_EQ(parameter(ground, torn), "start");
}

}  // namespace
}  // namespace cordillera::gpu::exact
