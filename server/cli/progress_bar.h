#pragma once
// Progress of a build, an export or a check on stderr: a bar where someone watches, a line for each stage and each tenth of it
// where a log is written.
#include <chrono>
#include <functional>
#include <string>

#include "cordillera.pb.h"

namespace cordillera::server {

class ProgressBar {
 public:
  enum class Style { bar, lines, none };
  using Clock = std::chrono::steady_clock;
  /// words: whether anything is to be shown.
  static Style style_of(bool words) { return words ? where_stderr_goes() : Style::none; }
  /// patience: of what is over by then, counted from here, nothing is shown. now: another clock than the wall's, for tests.
  explicit ProgressBar(Style style, Clock::duration patience = {}, std::function<Clock::time_point()> now = Clock::now)
      : style_(style), now_(std::move(now)), first_(now_() + patience) {}
  ~ProgressBar() { finish(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void show(const proto::Progress& progress);
  /// Shows what it is called with, as long as the bar lives; empty where nothing is shown, so that nobody counts for it.
  std::function<void(const proto::Progress&)> callback() {
    if (style_ == Style::none) return {};
    return [this](const proto::Progress& progress) { show(progress); };
  }
  /// Ends the bar's line.
  void finish();

 private:
  static Style where_stderr_goes();

  Style style_;
  std::function<Clock::time_point()> now_;
  Clock::time_point first_;  ///< moment at which something may be shown
  bool open_ = false;
  std::string stage_;
  int tenth_ = 0;  ///< of the stage, the last that was told
};

/// Of commands that are mostly over in no time: an export, a check.
inline constexpr ProgressBar::Clock::duration kBarPatience = std::chrono::seconds(1);

/// "build 30 %, 1 min 20 s left"; only the stage where there is nothing to count.
std::string progress_text(const proto::Progress& progress);

/// As a person says it: "40 s", "1 min 20 s", "2 h 5 min".
std::string duration_text(double seconds);

}  // namespace cordillera::server
