#pragma once
// How far a long work is, on its way to whoever asked for it.
#include <chrono>
#include <functional>
#include <mutex>
#include <string>

#include "cordillera.pb.h"

namespace cordillera::pipeline {

/// Called from one thread at a time, at most a few times a second.
using ProgressCallback = std::function<void(const proto::Progress&)>;

/// Tells the beginning and the end of every stage, and what lies between no more often than a few times a second, with the time
/// left as the rate so far suggests.
class Teller {
 public:
  explicit Teller(const ProgressCallback& callback) : callback_(callback) {}
  /// done: what an earlier process has made.
  void stage(const std::string& name, double total, double done = 0) {
    progress_.set_stage(name);
    progress_.set_total(total);
    started_ = Clock::now();
    first_ = -1;
    last_ = {};
    tell(done);
  }
  /// One more block is on disk for good.
  void committed_block() {
    const std::lock_guard lock(mutex_);
    progress_.set_blocks(progress_.blocks() + 1);
  }
  /// Other provisional tiles can be read.
  void provisional() {
    const std::lock_guard lock(mutex_);
    progress_.set_provisional(true);
    if (callback_) callback_(progress_);
    progress_.set_provisional(false);
  }
  void tell(double done) {
    const std::lock_guard lock(mutex_);  // workers tell too
    const auto now = Clock::now();
    if (done < progress_.total() && now - last_ < std::chrono::milliseconds(200)) return;
    last_ = now;
    if (first_ < 0) first_ = done;
    const double seconds = std::chrono::duration<double>(now - started_).count();
    progress_.set_done(done);
    const double moved = done - first_;
    progress_.set_seconds_left(moved > 0 && seconds > 1 ? seconds * (progress_.total() - done) / moved : -1);
    if (callback_) callback_(progress_);
  }

 private:
  using Clock = std::chrono::steady_clock;
  const ProgressCallback& callback_;
  proto::Progress progress_;
  std::mutex mutex_;
  Clock::time_point started_, last_;
  double first_ = -1;
};

}  // namespace cordillera::pipeline
