#pragma once
// What every mesh of gpu/exact must be, for tests of it.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "tests/gpu/exact_judge.h"
#include "tests/gpu/exact_terrain.h"

namespace cordillera::gpu::exact {

inline BlockPlan plan_of(double tolerance_m, int levels, int tile_side) {
  BlockPlan plan;
  plan.tile_side = tile_side;
  plan.levels = doubling_levels(tolerance_m, levels);
  return plan;
}

inline Block whole(const proto::Samples& samples) {
  return {&samples, samples.west, samples.south, samples.columns, samples.rows, {}};
}

inline ParallelFor three_threads() {
  return [](std::size_t count, const std::function<void(std::size_t)>& work) {
    std::atomic<std::size_t> next{0};
    const auto take = [&] {
      for (std::size_t i; (i = next.fetch_add(1)) < count;) work(i);
    };
    std::thread second(take), third(take);
    take();
    second.join();
    third.join();
  };
}

inline std::vector<std::vector<BlockMesh>> simplified(std::span<const Block> blocks, const BlockPlan& plan,
                                                      ParallelFor parallel = one_after_the_other) {
  auto simplifier = make_block_simplifier("cpu", std::move(parallel));
  auto result = (*simplifier)->simplify(blocks, plan);
  EXPECT_TRUE(result.ok()) << result.problem().line();
  return result.ok() ? *result : std::vector<std::vector<BlockMesh>>(blocks.size(), std::vector<BlockMesh>(plan.levels.size()));
}

inline std::uint64_t hash_of(const std::vector<BlockMesh>& levels, const Block& block, const BlockPlan& plan) {
  std::uint64_t hash = 0;
  for (std::size_t l = 0; l < levels.size(); ++l) hash = hash * 31 + Judge(block, plan, l).judge(levels[l], Measure::shape).hash;
  return hash;
}

/// What triangles must be, and what they show and hide.
inline void expect_sound(const Verdict& verdict) {
  EXPECT_EQ(verdict.uncovered, 0u);
  EXPECT_EQ(verdict.hidden, 0u);
  EXPECT_EQ(verdict.invented, 0u);
  EXPECT_EQ(verdict.turned, 0u);
  EXPECT_EQ(verdict.astride, 0u);
  EXPECT_EQ(verdict.mislabelled, 0u);
  EXPECT_TRUE(verdict.exact_area);
  EXPECT_LE(verdict.valence, 14);
}

/// share: of a finer level's triangles, that a coarser one has at the most.
inline void expect_laws(const Block& block, const BlockPlan& plan, const std::vector<BlockMesh>& levels, double share = 1) {
  for (std::size_t l = 0; l < levels.size(); ++l) {
    SCOPED_TRACE("level " + std::to_string(l));
    const Verdict verdict = Judge(block, plan, l).judge(levels[l], Measure::samples);
    EXPECT_LE(verdict.max_m, plan.levels[l].tolerance_m);
    EXPECT_NEAR(levels[l].max_error_m, verdict.max_m, 1e-6);
    EXPECT_NEAR(levels[l].rmse_m, verdict.rmse_m, 0.01 * plan.levels[l].tolerance_m);
    expect_sound(verdict);
    EXPECT_TRUE(l == 0 ||
                static_cast<double>(levels[l].triangles.size()) <= share * static_cast<double>(levels[l - 1].triangles.size()));
  }
}

}  // namespace cordillera::gpu::exact
