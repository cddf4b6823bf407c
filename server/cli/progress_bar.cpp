#include "server/cli/progress_bar.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace cordillera::server {
namespace {

constexpr int kBar = 30;

double share_of(const proto::Progress& progress) {
  return progress.total() > 0 ? std::clamp(progress.done() / progress.total(), 0.0, 1.0) : 0.0;
}

}  // namespace

std::string duration_text(double seconds) {
  const long whole = std::lround(seconds);
  if (whole < 1) return "less than a second";
  if (whole < 60) return std::to_string(whole) + " s";
  if (whole < 3600) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return std::to_string(whole / 3600) + " h " + std::to_string(whole / 60 % 60) + " min";
}

std::string progress_text(const proto::Progress& progress) {
  std::string text = progress.stage();
  if (progress.total() <= 1) return text;  // a stage of one step is there or over
  // What is counted (samples, tiles) differs from stage to stage and tells a person nothing; the share does.
  text.append(" ").append(std::to_string(static_cast<int>(std::floor(100 * share_of(progress))))).append(" %");
  if (progress.seconds_left() >= 0 && progress.done() < progress.total())
    text += ", " + duration_text(progress.seconds_left()) + " left";
  return text;
}

ProgressBar::Style ProgressBar::where_stderr_goes() { return isatty(STDERR_FILENO) ? Style::bar : Style::lines; }

void ProgressBar::show(const proto::Progress& progress) {
  if (style_ == Style::none || now_() < first_) return;
  if (style_ == Style::bar) {
    std::string bar(static_cast<std::size_t>(std::lround(kBar * share_of(progress))), '#');
    bar.resize(kBar, '.');
    std::fprintf(stderr, "\r[%s] %s\033[K", bar.c_str(), progress_text(progress).c_str());
    std::fflush(stderr);
    open_ = true;
    return;
  }
  const int tenth = static_cast<int>(std::floor(10 * share_of(progress)));
  if (progress.stage() == stage_ && (tenth <= tenth_ || progress.total() <= 1)) return;
  stage_ = progress.stage();
  tenth_ = tenth;
  std::fprintf(stderr, "%s\n", progress_text(progress).c_str());
}

void ProgressBar::finish() {
  if (open_) std::fprintf(stderr, "\r\033[K");
  open_ = false;
}

}  // namespace cordillera::server
