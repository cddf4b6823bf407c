#pragma once
// Where the time of a build went, stage after stage, by the clock on the wall.
#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace cordillera::server {

class StageTimes {
 public:
  using Clock = std::chrono::steady_clock;
  /// now: another clock than the wall's, for tests.
  explicit StageTimes(std::function<Clock::time_point()> now = Clock::now) : now_(std::move(now)) {}
  /// The stage that was under way ends. The same name again changes nothing.
  void enter(const std::string& stage);
  /// "open 0.02 s, build 3.10 s, publish 0.21 s; 3.33 s in all". Ends the last stage.
  std::string text();

 private:
  void end();
  std::function<Clock::time_point()> now_;
  std::vector<std::pair<std::string, double>> stages_;  ///< seconds
  Clock::time_point since_;
  bool open_ = false;
};

}  // namespace cordillera::server
