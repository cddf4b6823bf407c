#pragma once
// Whether the other side of a connection keeps up.
#include <chrono>
#include <cstdint>

#include "server/front/limits.h"

namespace cordillera::server::front {

using Clock = std::chrono::steady_clock;

/// Only time that was spent waiting for the client counts: a slow disk or a busy machine is not its fault.
class Pace {
 public:
  explicit Pace(const Limits& limits) : limits_(&limits) {}

  void start() { *this = Pace(*limits_); }
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
    return waited > limits_->grace && static_cast<double>(bytes_) < waited.count() * limits_->min_rate;
  }

 private:
  const Limits* limits_;
  Clock::time_point since_{};
  Clock::duration waited_{};
  std::uint64_t bytes_ = 0;
  bool waiting_ = false;
};

}  // namespace cordillera::server::front
