#pragma once
// How long parts of a work take.
#include <chrono>
#include <utility>

namespace cordillera::proto {

class StopWatch {
 public:
  /// Seconds since the last call, or the start.
  double lap() {
    const auto now = Clock::now();
    return std::chrono::duration<double>(now - std::exchange(last_, now)).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
};

}  // namespace cordillera::proto
