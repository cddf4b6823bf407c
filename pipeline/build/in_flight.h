#pragma once
// Tasks of a build, several of them under way at once: while one ends with few tiles, or waits for its file, the threads work on
// another.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
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

/// Tasks that begin as they become known, each in a thread of its own, and are taken as they end. For one thread. Whoever
/// destroys it waits for those under way.
class RunningTasks {
 public:
  using Made = proto::Result<FinishedTask>;
  explicit RunningTasks(std::function<Made(std::size_t)> make) : make_(std::move(make)) {}

  void begin(std::size_t k) {
    under_way_.emplace(k, std::async(std::launch::async, [this, k] {
                         const std::shared_ptr<void> at_the_end(nullptr, [&](void*) {
                           const std::lock_guard lock(mutex_);
                           ended_.push_back(k);
                           changed_.notify_one();
                         });
                         return make_(k);
                       }));
  }
  std::size_t count() const { return under_way_.size(); }
  /// The first that has ended; none, if none does within this time.
  std::optional<std::pair<std::size_t, Made>> ended(std::chrono::milliseconds within) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, within, [this] { return !ended_.empty(); })) return std::nullopt;
    const std::size_t k = ended_.front();
    ended_.pop_front();
    lock.unlock();
    auto task = under_way_.extract(k);
    return std::pair(k, task.mapped().get());
  }

 private:
  const std::function<Made(std::size_t)> make_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::size_t> ended_;
  std::map<std::size_t, std::future<Made>> under_way_;  // the last: its tasks use what is before it
};

}  // namespace cordillera::pipeline
