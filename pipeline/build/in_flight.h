#pragma once
// Tasks of a build, several of them under way at once: while one ends with few tiles, or waits for its file, the threads work on
// another.
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <vector>

#include "pipeline/store/store.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// make(k) for 0 .. count - 1, at_once of them side by side, each in a thread of its own; take(k, task) in their order, in the
/// caller's. Those that end before their turn make room for others. The first problem ends it, after those under way.
inline proto::Result<void> in_flight(std::size_t count, std::size_t at_once,
                                     const std::function<proto::Result<FinishedTask>(std::size_t)>& make,
                                     const std::function<proto::Result<void>(std::size_t, FinishedTask&&)>& take) {
  constexpr std::size_t kMostBegun = 4;  // times at_once, with those that wait for their turn: a finished task is a few megabytes
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<char> ended(count, 0);
  std::size_t running = 0, next = 0;
  const auto run = [&](std::size_t k) {
    const std::shared_ptr<void> at_the_end(nullptr, [&](void*) {
      const std::lock_guard lock(mutex);
      --running;
      ended[k] = 1;
      changed.notify_one();
    });
    return make(k);
  };
  std::deque<std::future<proto::Result<FinishedTask>>> under_way;
  for (std::size_t k = 0; k < count; ++k) {
    std::unique_lock lock(mutex);
    const auto has_room = [&] { return next < count && running < at_once && next - k < kMostBegun * at_once; };
    for (;;) {
      for (; has_room(); ++next, ++running) under_way.push_back(std::async(std::launch::async, run, next));
      if (ended[k]) break;
      changed.wait(lock, [&] { return ended[k] != 0 || has_room(); });
    }
    lock.unlock();
    auto made = under_way.front().get();
    under_way.pop_front();
    if (!made.ok()) return made.problem();
    if (auto taken = take(k, std::move(made).value()); !taken.ok()) return taken;
  }
  return {};
}

}  // namespace cordillera::pipeline
