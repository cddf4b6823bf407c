#pragma once
// How long parts of a work take.
#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

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

struct StageTime {
  std::string name;
  double seconds = 0;
};

/// To the stage of this name; a new one comes last.
inline void add_time(std::vector<StageTime>& stages, const std::string& name, double seconds) {
  auto at = std::find_if(stages.begin(), stages.end(), [&](const StageTime& known) { return known.name == name; });
  if (at == stages.end()) at = stages.insert(at, {name, 0});
  at->seconds += seconds;
}

}  // namespace cordillera::proto
