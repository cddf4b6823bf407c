#pragma once
// The threads of a build: loops over independent pieces of work, several of them side by side.
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace cordillera::pipeline {

class Workers {
 public:
  explicit Workers(unsigned threads);  ///< 0: one for each usable core
  ~Workers();                          ///< no loop is under way
  unsigned threads() const { return static_cast<unsigned>(threads_.size()); }

  enum class Haste : std::uint8_t { none, somebody_waits };
  /// Calls work(item, worker) for every item in 0..count-1, worker in 0..threads()-1 (two calls of one worker never overlap, in
  /// whatever loops). Returns when all are done. The first exception is thrown again here, after the others have ended. Many may
  /// call at once, but not from within work. The loop with the fewest items left goes first: what it holds in memory is free the
  /// sooner; before it one that somebody waits for.
  void each(std::size_t count, const std::function<void(std::size_t item, unsigned worker)>& work, Haste haste = Haste::none);
  /// each(), for whom the worker does not matter. It outlives what is returned.
  std::function<void(std::size_t count, const std::function<void(std::size_t item)>& work)> loop() {
    return [this](std::size_t count, const std::function<void(std::size_t)>& work) {
      each(count, [&](std::size_t item, unsigned) { work(item); });
    };
  }
  /// Likewise work(item); the caller takes items, too, and does not wait until a worker is free. For callers that wait for
  /// something other than a processor, for with them there is one thread more at work. Not where one thread was asked for. It
  /// goes first, too: what the caller feeds, a device, stands still meanwhile.
  void with_caller(std::size_t count, const std::function<void(std::size_t item)>& work);

 private:
  struct Loop;
  void end();
  void run(unsigned worker);
  Loop* next();  ///< with items left; null: none
  void do_one(Loop& loop, unsigned worker, std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;  // of all that follows, and of loops
  std::condition_variable changed_;
  std::vector<Loop*> loops_;  // in the order that they began
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace cordillera::pipeline
