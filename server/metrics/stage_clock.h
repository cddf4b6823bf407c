#pragma once
// From the reports of one build to what is counted of all: seconds of stages, blocks, samples.
#include <chrono>
#include <string>

#include "cordillera.pb.h"
#include "server/metrics/service_metrics.h"

namespace cordillera::server::metrics {

/// One build's. Logs each stage as it ends.
class StageClock {
 public:
  explicit StageClock(ServiceMetrics& metrics) : metrics_(metrics), build_start_(Clock::now()), stage_start_(build_start_) {}
  void report(const proto::Progress& now);
  /// outcome: ready, failed, cancelled or, of a lazy build that waits for looks, paused.
  void end(const std::string& outcome);

 private:
  using Clock = std::chrono::steady_clock;
  void end_stage();

  ServiceMetrics& metrics_;
  Clock::time_point build_start_, stage_start_;
  proto::Progress last_;
};

}  // namespace cordillera::server::metrics
