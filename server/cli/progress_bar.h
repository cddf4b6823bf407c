#pragma once
// Progress of a build on stderr: a bar where someone watches, a line for each stage and each tenth of it where a log is written.
#include <string>

#include "cordillera.pb.h"

namespace cordillera::server {

class ProgressBar {
 public:
  enum class Style { bar, lines, none };
  static Style where_stderr_goes();
  explicit ProgressBar(Style style) : style_(style) {}
  void show(const proto::Progress& progress);
  /// Ends the bar's line.
  void finish();

 private:
  Style style_;
  bool open_ = false;
  std::string stage_;
  int tenth_ = 0;  ///< of the stage, the last that was told
};

/// "build 30 %, 1 min 20 s left"; only the stage where there is nothing to count.
std::string progress_text(const proto::Progress& progress);

/// As a person says it: "40 s", "1 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

}  // namespace cordillera::server
