#pragma once
// Published datasets, kept open while they are being read.
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "pipeline/faces/terrain.h"
#include "server/layout.h"
#include "server/metrics/service_metrics.h"

namespace cordillera::server {

/// Thread-safe. A reader that was handed out outlives forget().
class Library {
 public:
  Library(Layout layout, metrics::ServiceMetrics& metrics) : layout_(std::move(layout)), metrics_(metrics) {}
  proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> open(const std::string& id);
  void forget(const std::string& id);

 private:
  Layout layout_;
  metrics::ServiceMetrics& metrics_;
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<const pipeline::faces::Terrain>>> open_;  ///< the last used first
};

}  // namespace cordillera::server
