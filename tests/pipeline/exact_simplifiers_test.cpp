// Exact blocks that many threads ask for, and that one call of a simplifier makes together.
#include "pipeline/build/exact/exact_simplifiers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <stdexcept>
#include <thread>
#include <vector>

#include "pipeline/build/stages.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;

constexpr std::int32_t kSide = 64;

/// A square of waves, each block's others.
proto::Samples waves(int number) {
  proto::Samples samples;
  samples.columns = samples.rows = kSide + 1;
  for (int y = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x)
      samples.height.push_back(static_cast<std::int32_t>(30000 * std::sin(0.1 * x + number) * std::cos(0.07 * y * (number + 1))));
  }
  return samples;
}

gpu::exact::BlockPlan plan_of(double tolerance_m) {
  gpu::exact::BlockPlan plan;
  plan.tile_side = kSide;
  plan.levels = {{tolerance_m}, {2 * tolerance_m}};
  return plan;
}

/// A block, and what became of it.
struct Wanted {
  proto::Samples samples;
  gpu::exact::BlockPlan plan;
  std::vector<BlockMesh> levels;
  std::thread::id made_by, asked_by;

  proto::Result<void> ask(
      ExactSimplifiers& simplifiers, const std::function<void()>& first = [] {}) {
    gpu::exact::Block block;
    block.samples = &samples;
    block.columns = block.rows = kSide + 1;
    asked_by = std::this_thread::get_id();
    const auto take = [&](std::size_t level, BlockMesh&& mesh) {
      EXPECT_EQ(level, levels.size());
      made_by = std::this_thread::get_id();
      if (level == 0) first();
      levels.push_back(std::move(mesh));
    };
    return simplifiers.simplify(block, plan, take, nullptr);
  }
  void expect_as_alone() const {
    gpu::exact::Block block;
    block.samples = &samples;
    block.columns = block.rows = kSide + 1;
    const auto alone = (*gpu::exact::make_block_simplifier("cpu"))->simplify({&block, 1}, plan);
    ASSERT_EQ(levels.size(), 2u);
    for (std::size_t l = 0; l < levels.size(); ++l) {
      EXPECT_GT(levels[l].triangles.size(), 10u);
      EXPECT_EQ(levels[l].x, (*alone)[0][l].x);
      EXPECT_EQ(levels[l].y, (*alone)[0][l].y);
      EXPECT_EQ(levels[l].height, (*alone)[0][l].height);
      EXPECT_EQ(levels[l].triangles, (*alone)[0][l].triangles);
    }
  }
};

class Together : public testing::Test {
 protected:
  void SetUp() override {
    simplifiers_.open("cpu", {1, 4}, {1, 1});
    ASSERT_TRUE(simplifiers_.opened().ok());
  }

  /// The first has the only turn until all others wait.
  void ask_all(std::vector<Wanted>& wanted) {
    std::promise<void> begun;
    std::vector<std::future<proto::Result<void>>> results;
    results.push_back(std::async(std::launch::async, [&] {
      return wanted[0].ask(simplifiers_, [&] {
        begun.set_value();
        while (simplifiers_.waiting() + 1 < wanted.size()) std::this_thread::yield();
      });
    }));
    begun.get_future().wait();
    for (std::size_t k = 1; k < wanted.size(); ++k)
      results.push_back(std::async(std::launch::async, [&, k] { return wanted[k].ask(simplifiers_); }));
    for (auto& result : results) problems_.push_back(result.get());
    EXPECT_EQ(simplifiers_.waiting(), 0u);
  }

  const std::atomic<bool> stop_{false};
  ExactSimplifiers simplifiers_{{gpu::one_after_the_other, gpu::one_after_the_other}, stop_};
  std::vector<proto::Result<void>> problems_;
};

TEST_F(Together, BlocksAreWhatTheyAreAlone) {
  std::vector<Wanted> wanted;
  for (int k = 0; k < 9; ++k) wanted.push_back({waves(k), plan_of(k % 3 == 1 ? 2 : 1), {}, {}, {}});
  ask_all(wanted);
  std::size_t by_others = 0;
  for (const Wanted& one : wanted) {
    one.expect_as_alone();
    by_others += one.made_by != one.asked_by ? 1 : 0;
  }
  for (const auto& result : problems_) EXPECT_TRUE(result.ok());
  // Five with one plan wait, up to four go together; three with the other one, which all go together.
  EXPECT_EQ(by_others, 3u + 2u);
}

TEST_F(Together, APlanThatCannotBeIsAProblemOfItsOwn) {
  std::vector<Wanted> wanted;
  for (int k = 0; k < 5; ++k) wanted.push_back({waves(k), plan_of(k == 3 ? -1 : 1), {}, {}, {}});
  ask_all(wanted);
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    EXPECT_EQ(problems_[k].ok(), k != 3);
    if (k != 3) wanted[k].expect_as_alone();
  }
}

TEST(Opening, ADeviceThatIsNotThereIsAProblemOfWhoeverAsks) {
  const std::atomic<bool> stop{false};
  ExactSimplifiers simplifiers({gpu::one_after_the_other, gpu::one_after_the_other}, stop);
  simplifiers.open("cuda:99", {1, 1}, {2, 4});
  std::vector<std::future<proto::Result<void>>> results;
  std::vector<Wanted> wanted(3, {waves(0), plan_of(1), {}, {}, {}});
  for (Wanted& one : wanted) results.push_back(std::async(std::launch::async, [&] { return one.ask(simplifiers); }));
  for (auto& result : results) EXPECT_EQ(result.get().problem().type, "device-unavailable");
  EXPECT_EQ(simplifiers.opened().problem().type, "device-unavailable");
  EXPECT_EQ(simplifiers.waiting(), 0u);
}

TEST(Opening, ThereIsRoomForAGpuUntilItIsKnownThatThereIsNone) {
  const std::atomic<bool> stop{false};
  ExactSimplifiers simplifiers({gpu::one_after_the_other, gpu::one_after_the_other}, stop);
  simplifiers.open("auto", {3, 1}, {2, 4});
  ASSERT_TRUE(simplifiers.opened().ok());
  const bool on_gpu = simplifiers.device() != "cpu";
  EXPECT_EQ(simplifiers.on_gpu(), on_gpu);
  EXPECT_EQ(simplifiers.at_once(), on_gpu ? 8u : 3u);
}

TEST(DeviceOf, AutoIsTheCpuWhereItsThreadsAreDoneBeforeAGpuIsOpen) {
  proto::Plan plan;
  plan.set_exact(true);
  for (const std::int32_t side : {-500, 100, 499, 1099}) plan.add_window(side);  // a million samples
  EXPECT_EQ(device_of(plan, "auto", 16), "cpu");
  EXPECT_EQ(device_of(plan, "", 4), "cpu");
  EXPECT_EQ(device_of(plan, "auto", 1), "auto") << "one thread would take longer";
  EXPECT_EQ(device_of(plan, "cuda", 16), "cuda") << "it was asked for";
  plan.mutable_options()->set_strategy("cleap");
  EXPECT_EQ(device_of(plan, "auto", 16), "auto") << "other strategies may take a thousand times as long on a CPU";
  plan.mutable_options()->clear_strategy();
  plan.set_window(2, 4499);
  EXPECT_EQ(device_of(plan, "auto", 16), "cpu");
  plan.set_window(3, 2099);
  EXPECT_EQ(device_of(plan, "auto", 16), "auto") << "ten million";
}

/// Who waits for a call that ends with an exception has it too, and is not left waiting.
TEST_F(Together, AnExceptionReachesAllOfACall) {
  std::vector<Wanted> wanted;
  for (int k = 0; k < 4; ++k) wanted.push_back({waves(k), plan_of(1), {}, {}, {}});
  const auto fails = [] { throw std::runtime_error("no room for a thread"); };
  std::promise<void> begun;
  auto first = std::async(std::launch::async, [&] {
    return wanted[0].ask(simplifiers_, [&] {
      begun.set_value();
      while (simplifiers_.waiting() < 3) std::this_thread::yield();
    });
  });
  begun.get_future().wait();
  std::vector<std::future<void>> others;
  for (std::size_t k = 1; k < 4; ++k) {
    others.push_back(std::async(
        std::launch::async, [&, k] { EXPECT_THROW(static_cast<void>(wanted[k].ask(simplifiers_, fails)), std::runtime_error); }));
  }
  EXPECT_TRUE(first.get().ok());
  for (auto& other : others) other.get();
  wanted[0].levels.clear();
  EXPECT_TRUE(wanted[0].ask(simplifiers_).ok());  // and the turn is free again
}

}  // namespace
}  // namespace cordillera::pipeline
