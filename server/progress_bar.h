#pragma once
// Progress of a build on stderr: a bar where someone watches, a line now and then where a log is written.
#include <chrono>
#include <string>

#include "cordillera.pb.h"

namespace cordillera::server {

class ProgressBar {
 public:
  ProgressBar();
  void show(const proto::Progress& progress);
  /// Ends the bar's line.
  void finish();

 private:
  bool terminal_;
  bool open_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point last_;
};

/// "build 30 %, 1 min 20 s left"; only the stage where there is nothing to count.
std::string progress_text(const proto::Progress& progress);

/// As a person says it: "40 s", "1 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

}  // namespace cordillera::server
