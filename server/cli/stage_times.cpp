#include "server/cli/stage_times.h"

#include <cstdio>

namespace cordillera::server {
namespace {

std::string seconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f s", seconds);
  return text;
}

}  // namespace

void StageTimes::end() {
  if (open_) stages_.back().second = std::chrono::duration<double>(now_() - since_).count();
  open_ = false;
}

void StageTimes::enter(const std::string& stage) {
  if (open_ && stages_.back().first == stage) return;
  end();
  stages_.emplace_back(stage, 0);
  since_ = now_();
  open_ = true;
}

std::string StageTimes::text() {
  end();
  std::string out;
  double all = 0;
  for (const auto& [stage, seconds] : stages_) {
    out += (out.empty() ? "" : ", ") + stage + " " + seconds_text(seconds);
    all += seconds;
  }
  return out + "; " + seconds_text(all) + " in all";
}

}  // namespace cordillera::server
