#pragma once
// Tasks of a build, several of them under way at once: while one ends with few tiles, or waits for its file, the threads work on
// another.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "pipeline/store/store.h"
#include "proto/result.h"

namespace cordillera::pipeline {

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
    return first(lock);
  }
  /// The first that has ended, or does next. Some have to be under way.
  std::pair<std::size_t, Made> ended() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !ended_.empty(); });
    return first(lock);
  }

 private:
  std::pair<std::size_t, Made> first(std::unique_lock<std::mutex>& lock) {
    const std::size_t k = ended_.front();
    ended_.pop_front();
    lock.unlock();
    auto task = under_way_.extract(k);
    return {k, task.mapped().get()};
  }

  const std::function<Made(std::size_t)> make_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::size_t> ended_;
  std::map<std::size_t, std::future<Made>> under_way_;  // the last: its tasks use what is before it
};

/// make(k) for 0 .. count - 1, at_once() of them side by side, each in a thread of its own; take(k, task) in their order, in the
/// caller's. Those that end before their turn make room for others. The first problem ends it, after those under way. at_once()
/// is asked after each.
inline proto::Result<void> in_flight(std::size_t count, const std::function<std::size_t()>& at_once,
                                     const std::function<proto::Result<FinishedTask>(std::size_t)>& make,
                                     const std::function<proto::Result<void>(std::size_t, FinishedTask&&)>& take) {
  // That wait for their turn: a finished task is a few megabytes.
  const auto most_waiting = [](std::size_t most) { return std::min<std::size_t>(3 * most, 64); };
  std::map<std::size_t, RunningTasks::Made> waiting;
  RunningTasks running(make);
  for (std::size_t k = 0, next = 0; k < count;) {
    const std::size_t most = at_once();
    while (next < count && running.count() < most && next - k < most + most_waiting(most)) running.begin(next++);
    auto made = waiting.extract(k);
    if (!made) {
      waiting.insert(running.ended());
      continue;
    }
    if (!made.mapped().ok()) return made.mapped().problem();
    if (auto taken = take(k, std::move(made.mapped()).value()); !taken.ok()) return taken;
    ++k;
  }
  return {};
}

/// The same, but each is taken as it ends: where their order is no matter, none waits for one that takes longer. After a problem
/// none begins, and those under way are still taken; of several problems the one of the least k is told.
inline proto::Result<void> in_flight_as_they_end(std::size_t count, const std::function<std::size_t()>& at_once,
                                                 const std::function<proto::Result<FinishedTask>(std::size_t)>& make,
                                                 const std::function<proto::Result<void>(FinishedTask&&)>& take) {
  RunningTasks running(make);
  std::map<std::size_t, proto::Problem> problems;
  for (std::size_t next = 0;;) {
    const std::size_t most = at_once();
    while (problems.empty() && next < count && running.count() < most) running.begin(next++);
    if (running.count() == 0) break;
    auto [k, made] = running.ended();
    if (!made.ok()) {
      problems.emplace(k, made.problem());
      continue;
    }
    if (auto taken = take(std::move(made).value()); !taken.ok()) return taken;
  }
  return problems.empty() ? proto::Result<void>() : problems.begin()->second;
}

}  // namespace cordillera::pipeline
