#pragma once
// Where the time of a build went, stage after stage, by the clock on the wall.
#include <chrono>
#include <string>
#include <utility>
#include <vector>

namespace cordillera::server {

class StageTimes {
 public:
  /// The stage that was under way ends. The same name again changes nothing.
  void enter(const std::string& stage);
  /// "open 0.02 s, build 3.10 s, publish 0.21 s; 3.33 s in all". Ends the last stage.
  std::string text();

 private:
  using Clock = std::chrono::steady_clock;
  void end();
  std::vector<std::pair<std::string, double>> stages_;  ///< seconds
  Clock::time_point since_;
  bool open_ = false;
};

}  // namespace cordillera::server
