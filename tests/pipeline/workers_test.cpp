#include "pipeline/threads/workers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "pipeline/build/in_flight.h"

namespace cordillera::pipeline {
namespace {

TEST(Workers, DoEveryItemOnce) {
  Workers workers(3);
  std::vector<std::atomic<int>> done(1000);
  workers.each(done.size(), [&](std::size_t k, unsigned worker) {
    ASSERT_LT(worker, 3u);
    ++done[k];
  });
  for (const auto& times : done) EXPECT_EQ(times, 1);
  workers.each(0, [](std::size_t, unsigned) { FAIL(); });
}

/// Between any two items of others.
TEST(Workers, ALoopThatSomebodyWaitsForGoesFirst) {
  constexpr std::size_t kLong = 100'000;
  Workers workers(1);
  std::atomic<bool> begun{false}, met{false};
  std::size_t after = 0;  // the one worker's
  auto longer = std::async(std::launch::async, [&] {
    workers.each(kLong, [&](std::size_t, unsigned) {
      begun = true;
      if (!met) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (met) ++after;
    });
  });
  while (!begun) std::this_thread::yield();
  workers.each(
      300'000, [&](std::size_t, unsigned) { met = true; }, Workers::Haste::somebody_waits);
  longer.get();
  EXPECT_GT(after, kLong / 2) << "the hasty loop waited for the end of the long one";
}

/// Where all workers are busy the caller does it alone.
TEST(Workers, ACallerTakesPart) {
  Workers workers(2);
  std::atomic<int> held{0};
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  auto busy = std::async(std::launch::async, [&] {
    workers.each(2, [&](std::size_t, unsigned) {
      ++held;
      released.wait();
    });
  });
  while (held < 2) std::this_thread::yield();
  std::vector<int> done(50);
  workers.with_caller(done.size(), [&](std::size_t k) { ++done[k]; });
  EXPECT_EQ(done, std::vector<int>(50, 1));
  EXPECT_THROW(workers.with_caller(1, [](std::size_t) { throw std::runtime_error("no"); }), std::runtime_error);
  release.set_value();
  busy.get();
}

/// Loops of many callers share the threads, and what a worker has for itself it never has twice at a time.
TEST(Workers, LoopsSideBySide) {
  Workers workers(4);
  std::array<std::atomic<int>, 4> inside{};
  std::atomic<int> done{0}, overlaps{0};
  std::vector<std::future<void>> callers;
  for (int c = 0; c < 8; ++c) {
    callers.push_back(std::async(std::launch::async, [&] {
      for (int loop = 0; loop < 20; ++loop) {
        workers.each(25, [&](std::size_t, unsigned worker) {
          if (++inside[worker] != 1) ++overlaps;
          ++done;
          --inside[worker];
        });
      }
    }));
  }
  for (auto& caller : callers) caller.get();
  EXPECT_EQ(done, 8 * 20 * 25);
  EXPECT_EQ(overlaps, 0);
}

/// A loop of two items does not wait for the rest of a long one.
TEST(Workers, ShortLoopsGoFirst) {
  constexpr std::size_t kLong = 100'000;
  Workers workers(1);
  std::atomic<bool> begun{false};
  std::string order;  // this and the next are the one worker's
  bool met = false;
  auto longer = std::async(std::launch::async, [&] {
    workers.each(kLong, [&](std::size_t, unsigned) {
      begun = true;
      if (!met)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the other caller comes while this loop lasts, however late
      order += 'l';
    });
  });
  while (!begun) std::this_thread::yield();
  const auto short_item = [&](std::size_t, unsigned) {
    met = true;
    order += 's';
  };
  auto shorter = std::async(std::launch::async, [&] { workers.each(2, short_item); });
  longer.get();
  shorter.get();
  EXPECT_EQ(order.size(), kLong + 2);
  EXPECT_LT(order.find("ss"), kLong - 1) << "the short loop waited for the end of the long one";
}

TEST(Workers, AnExceptionEndsItsLoopOnly) {
  Workers workers(2);
  std::atomic<int> done{0};
  auto other = std::async(std::launch::async, [&] { workers.each(200, [&](std::size_t, unsigned) { ++done; }); });
  EXPECT_THROW(workers.each(100,
                            [](std::size_t k, unsigned) {
                              if (k == 3) throw std::runtime_error("three");
                            }),
               std::runtime_error);
  other.get();
  EXPECT_EQ(done, 200);
  workers.each(5, [&](std::size_t, unsigned) { ++done; });
  EXPECT_EQ(done, 205);
}

TEST(RunningTasks, AreTakenAsTheyEndAndWaitedFor) {
  constexpr auto kLong = std::chrono::minutes(10);
  std::atomic<int> ended{0};
  std::promise<void> second_goes;
  std::shared_future<void> go(second_goes.get_future());
  {
    RunningTasks running([&](std::size_t k) -> proto::Result<FinishedTask> {
      if (k == 1) go.wait();
      ++ended;
      if (k == 2) return proto::Problem{"three", "", "", ""};
      return FinishedTask{};
    });
    running.begin(1);
    running.begin(0);
    const auto first = running.ended(kLong);
    ASSERT_TRUE(first);
    EXPECT_EQ(first->first, 0u);
    EXPECT_TRUE(first->second.ok());
    EXPECT_FALSE(running.ended(std::chrono::milliseconds(0)));
    EXPECT_EQ(running.count(), 1u);
    running.begin(2);
    const auto failed = running.ended(kLong);
    ASSERT_TRUE(failed);
    EXPECT_EQ(failed->second.problem().type, "three");
    second_goes.set_value();
  }
  EXPECT_EQ(ended, 3) << "the one that nobody took was waited for";
}

TEST(InFlight, TasksAreTakenInOrderAndNoMoreAreMadeAtOnce) {
  std::atomic<int> now{0}, most{0};
  std::vector<std::size_t> taken;
  const auto all = in_flight(
      30, [] { return 4; },
      [&](std::size_t k) -> proto::Result<FinishedTask> {
        const int here = ++now;
        for (int before = most; here > before && !most.compare_exchange_weak(before, here);) {}
        std::this_thread::sleep_for(std::chrono::milliseconds(k % 3));
        --now;
        FinishedTask task;
        task.node = {5, static_cast<std::int32_t>(k), 0};
        return task;
      },
      [&](std::size_t k, FinishedTask&& task) -> proto::Result<void> {
        EXPECT_EQ(task.node.x, static_cast<std::int32_t>(k));
        taken.push_back(k);
        return {};
      });
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(taken.size(), 30u);
  EXPECT_TRUE(std::is_sorted(taken.begin(), taken.end()));
  EXPECT_LE(most, 4);
}

TEST(InFlight, WhoTakesThemAsTheyEndDoesNotWaitForTheFirst) {
  std::promise<void> second_is_taken;
  std::atomic<bool> waited_in_vain{false};
  std::vector<std::int32_t> taken;
  const auto all = in_flight_as_they_end(
      5, [] { return 2; },
      [&](std::size_t k) -> proto::Result<FinishedTask> {
        if (k == 0) waited_in_vain = second_is_taken.get_future().wait_for(std::chrono::seconds(60)) != std::future_status::ready;
        FinishedTask task;
        task.node = {5, static_cast<std::int32_t>(k), 0};
        return task;
      },
      [&](FinishedTask&& task) -> proto::Result<void> {
        taken.push_back(task.node.x);
        if (task.node.x == 1) second_is_taken.set_value();
        return {};
      });
  EXPECT_TRUE(all.ok());
  EXPECT_FALSE(waited_in_vain);
  std::sort(taken.begin(), taken.end());
  EXPECT_EQ(taken, (std::vector<std::int32_t>{0, 1, 2, 3, 4}));
}

TEST(InFlight, AProblemOfWhatIsTakenAsItEndsEndsAll) {
  const auto make = [](std::size_t) -> proto::Result<FinishedTask> { return FinishedTask{}; };
  const auto broken = in_flight_as_they_end(
      1000, [] { return 3; },
      [](std::size_t k) -> proto::Result<FinishedTask> {
        if (k == 7) return proto::Problem{"raster-damaged", "the seventh", "", ""};
        return FinishedTask{};
      },
      [](FinishedTask&&) -> proto::Result<void> { return {}; });
  ASSERT_FALSE(broken.ok());
  EXPECT_EQ(broken.problem().detail, "the seventh");
  std::size_t taken = 0;
  const auto refused = in_flight_as_they_end(
      1000, [] { return 3; }, make,
      [&](FinishedTask&&) -> proto::Result<void> {
        if (++taken == 4) return proto::Problem{"disk-full", "the fourth", "", ""};
        return {};
      });
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().detail, "the fourth");
  EXPECT_EQ(taken, 4u);
}

TEST(InFlight, ThoseThatEndMakeRoomThoughTheFirstGoesOn) {
  std::promise<void> fifth;
  std::size_t taken = 0;
  bool waited_in_vain = true;
  const auto all = in_flight(
      6, [] { return 2; },
      [&](std::size_t k) -> proto::Result<FinishedTask> {
        if (k == 0) waited_in_vain = fifth.get_future().wait_for(std::chrono::seconds(60)) != std::future_status::ready;
        if (k == 4) fifth.set_value();
        return FinishedTask{};
      },
      [&](std::size_t k, FinishedTask&&) -> proto::Result<void> {
        EXPECT_EQ(k, taken++);
        return {};
      });
  EXPECT_TRUE(all.ok());
  EXPECT_EQ(taken, 6u);
  EXPECT_FALSE(waited_in_vain);
}

TEST(InFlight, WhereThereIsMoreRoomMoreBegin) {
  std::atomic<std::size_t> room{1};
  std::promise<void> second;
  bool waited_in_vain = true;
  const auto all = in_flight(
      3, [&] { return room.load(); },
      [&](std::size_t k) -> proto::Result<FinishedTask> {
        if (k == 0) room = 2;
        if (k == 1) waited_in_vain = second.get_future().wait_for(std::chrono::seconds(60)) != std::future_status::ready;
        if (k == 2) second.set_value();
        return FinishedTask{};
      },
      [](std::size_t, FinishedTask&&) -> proto::Result<void> { return {}; });
  EXPECT_TRUE(all.ok());
  EXPECT_FALSE(waited_in_vain);
}

TEST(InFlight, ThoseThatThrowEndIt) {
  const auto make = [](std::size_t k) -> proto::Result<FinishedTask> {
    if (k == 5) throw std::runtime_error("the fifth");
    return FinishedTask{};
  };
  const auto take = [](std::size_t, FinishedTask&&) -> proto::Result<void> { return {}; };
  EXPECT_THROW((void)in_flight(
                   20, [] { return 3; }, make, take),
               std::runtime_error);
}

TEST(InFlight, TheFirstProblemEndsIt) {
  std::atomic<int> made{0};
  std::size_t taken = 0;
  const auto all = in_flight(
      1000, [] { return 3; },
      [&](std::size_t k) -> proto::Result<FinishedTask> {
        ++made;
        if (k == 7) return proto::Problem{"raster-damaged", "the seventh", "", ""};
        return FinishedTask{};
      },
      [&](std::size_t, FinishedTask&&) -> proto::Result<void> {
        ++taken;
        return {};
      });
  ASSERT_FALSE(all.ok());
  EXPECT_EQ(all.problem().detail, "the seventh");
  EXPECT_EQ(taken, 7u);
  EXPECT_LE(made, 7 + 4 * 3);
}

}  // namespace
}  // namespace cordillera::pipeline
