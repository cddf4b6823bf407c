// Levels above blocks: without samples the promise holds for every one of them, and little is lost for it.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "gpu/exact/steps/triangle.h"
#include "tests/gpu/exact_above.h"
#include "tests/gpu/exact_laws.h"
#include "tests/gpu/regular_mesh.h"

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

/// A plane that is as it is known to be.
Ground plane_ground(std::int32_t columns, std::int32_t rows) {
  Ground ground;
  ground.columns = columns, ground.rows = rows;
  const std::size_t squares = ground.across() * ground.up();
  ground.squares.plane.assign(squares, {1000, 0, 0, 1});
  ground.squares.code.assign(64 * squares, 128);
  return ground;
}
/// One level of it; on a GPU, too, where there is one: the same mesh.
BlockMesh simplified_plane(const Ground& ground, std::int32_t step, std::int32_t tile_side) {
  const BlockMesh start = regular_mesh(ground.columns, ground.rows, step, 1000);
  const BlockPlan plan = plan_of(5, 1, tile_side);
  std::optional<BlockMesh> mesh;
  for (const char* device : {"cpu", "cuda"}) {
    const auto simplifier = make_block_simplifier(device);
    if (!simplifier.ok()) continue;  // no GPU
    const auto made = (*simplifier)->simplify_above(ground, start, plan);
    EXPECT_TRUE(made.ok()) << made.problem().line();
    if (!made.ok()) return {};
    if (mesh) {
      EXPECT_EQ(made->front().x, mesh->x);
      EXPECT_EQ(made->front().y, mesh->y);
      EXPECT_EQ(made->front().triangles, mesh->triangles);
    }
    mesh = made->front();
  }
  return *mesh;
}

// Edge functions of wider triangles would not fit into 32 bits: a plane is cut, however flat it is.
TEST(ExactAbove, TrianglesAreNoWiderThanEdgeFunctionsHold) {
  constexpr std::int32_t kColumns = 60'001, kRows = 2001;
  const BlockMesh mesh = simplified_plane(plane_ground(kColumns, kRows), 500, 1 << 20);
  std::int64_t twice_area = 0;
  std::int32_t widest = 0;
  for (const auto& t : mesh.triangles) {
    const auto [west, east] = std::minmax({mesh.x[t[0]], mesh.x[t[1]], mesh.x[t[2]]});
    widest = std::max<std::int32_t>(widest, east - west);
    const std::int64_t ux = mesh.x[t[1]] - mesh.x[t[0]], uy = mesh.y[t[1]] - mesh.y[t[0]], vx = mesh.x[t[2]] - mesh.x[t[0]],
                       vy = mesh.y[t[2]] - mesh.y[t[0]];
    EXPECT_GT(ux * vy - uy * vx, 0);
    twice_area += ux * vy - uy * vx;
  }
  EXPECT_EQ(twice_area, 2 * std::int64_t{kColumns - 1} * (kRows - 1));
  EXPECT_LE(widest, kWidestTriangle);
  EXPECT_GT(widest, kWidestTriangle / 2);
  EXPECT_LT(mesh.triangles.size(), 60u);
}

// Both sides of a ground that closes keep their vertices; elsewhere a plane needs hardly any.
TEST(ExactAbove, SidesStayWhereTheGroundCloses) {
  constexpr std::int32_t kColumns = 4097, kRows = 1025;
  Ground ground = plane_ground(kColumns, kRows);
  ground.goes_on = {false, true, false, true};
  ground.cut_column = (kColumns - 1) / 2;
  const BlockMesh mesh = simplified_plane(ground, 64, 2048);
  std::map<std::int32_t, std::set<std::int32_t>> on_column;
  std::map<std::uint32_t, std::size_t> triangles_at;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) on_column[mesh.x[v]].insert(mesh.y[v]);
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t v : t) ++triangles_at[v];
  }
  EXPECT_EQ(on_column[0].size(), 17u);
  EXPECT_EQ(on_column[kColumns - 1], on_column[0]);
  EXPECT_LT(on_column[(kColumns - 1) / 2].size(), 6u);
  // Each may become one vertex with what is across: 14 neighbours together.
  for (const auto& [v, triangles] : triangles_at) {
    if (mesh.x[v] == 0 || mesh.x[v] == kColumns - 1) { EXPECT_LE(triangles, 7u) << mesh.y[v]; }
    if (mesh.x[v] == (kColumns - 1) / 2) { EXPECT_LE(triangles, 8u) << mesh.y[v]; }
  }
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
  bad = ground;
  bad.cut_column = 16;  // no side of a tile
  EXPECT_EQ(parameter(bad, mesh), "ground");
  BlockMesh torn = mesh;
  torn.triangles.pop_back();
  EXPECT_EQ(parameter(ground, torn), "start");
}

}  // namespace
}  // namespace cordillera::gpu::exact
