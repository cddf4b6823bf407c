#pragma once
// Whether the other side of a connection keeps up.
#include <algorithm>
#include <chrono>
#include <cstdint>

#include "server/front/message/limits.h"

namespace cordillera::server::front {

using Clock = std::chrono::steady_clock;

/// Only time that was spent waiting for the client counts: a slow disk or a busy machine is not its fault.
class Pace {
 public:
  explicit Pace(const HttpLimits& limits) : limits_(&limits), least_rate_(limits.min_rate) {}

  void start() { *this = Pace(*limits_); }
  /// Starts with a known number of bytes. A large body has to move faster, or it would take hours.
  void start(std::uint64_t whole) {
    start();
    least_rate_ = std::max(least_rate_, static_cast<double>(whole) / static_cast<double>(limits_->answer.count()));
  }
  void wait(Clock::time_point now) {
    if (!waiting_) since_ = now;
    waiting_ = true;
  }
  void moved(std::uint64_t bytes, Clock::time_point now) {
    if (waiting_) waited_ += now - since_;
    waiting_ = false;
    bytes_ += bytes;
  }
  bool waiting() const { return waiting_; }
  bool too_slow(Clock::time_point now) const {
    if (!waiting_) return false;
    if (now - since_ > limits_->stall) return true;
    const std::chrono::duration<double> waited = waited_ + (now - since_);
    return waited > limits_->grace && static_cast<double>(bytes_) < waited.count() * least_rate_;
  }

 private:
  const HttpLimits* limits_;
  double least_rate_;  ///< bytes a second
  Clock::time_point since_{};
  Clock::duration waited_{};
  std::uint64_t bytes_ = 0;
  bool waiting_ = false;
};

}  // namespace cordillera::server::front
