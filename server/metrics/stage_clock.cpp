#include "server/metrics/stage_clock.h"

#include <algorithm>

#include "server/log/log.h"

namespace cordillera::server::metrics {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

void StageClock::report(const proto::Progress& now) {
  const bool same = now.stage() == last_.stage();
  if (!same) {
    end_stage();
    stage_start_ = Clock::now();
  }
  if (now.blocks() > last_.blocks()) metrics_.blocks.add(now.blocks() - last_.blocks());
  // A build that goes on where it was begins in the middle; it is this process's work alone that is counted.
  if (same && now.stage() == "build") metrics_.samples.add(std::max(0.0, now.done() - last_.done()));
  last_ = now;
}

void StageClock::end_stage() {
  if (last_.stage().empty()) return;
  const double seconds = seconds_since(stage_start_);
  metrics_.stage_seconds.add(seconds, {last_.stage()});
  log_debug("stage ended", {{"stage", last_.stage()}, {"seconds", seconds}});
}

void StageClock::end(const std::string& outcome) {
  end_stage();
  const double seconds = seconds_since(build_start_);
  metrics_.builds.add(1, {outcome});
  metrics_.build_seconds.observe(seconds, {outcome});
  log_info("build ended", {{"outcome", outcome}, {"seconds", seconds}, {"blocks", std::int64_t{last_.blocks()}}});
}

}  // namespace cordillera::server::metrics
