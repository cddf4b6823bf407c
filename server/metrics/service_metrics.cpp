#include "server/metrics/service_metrics.h"

namespace cordillera::server::metrics {
namespace {

const std::vector<double> kRequestBounds = {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 10, 60};
const std::vector<double> kBuildBounds = {1, 5, 15, 60, 300, 900, 3600, 14400, 86400};

const std::vector<double> kFirstTileBounds = {0.25, 0.5, 1, 2, 5, 10, 30, 60, 300, 3600};

const std::vector<double> kTileWaitBounds = {0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10, 30, 60, 600};

/// Methods that somebody made up are one.
std::string_view known_method(std::string_view method) {
  for (const std::string_view known : {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}) {
    if (method == known) return known;
  }
  return "other";
}

}  // namespace

ServiceMetrics::ServiceMetrics()
    : request_seconds("cordillera_http_request_duration_seconds",
                      "Seconds until the answer was made; of a stream until its beginning.", kRequestBounds, {"route"}),
      build_seconds("cordillera_build_duration_seconds", "Seconds that builds took, from their start to their end.", kBuildBounds,
                    {"outcome"}),
      first_tile_seconds("cordillera_first_tile_seconds",
                         "Seconds from the last byte of a post to the first tiles that can be read.", kFirstTileBounds, {"kind"}),
      tile_wait_seconds("cordillera_tile_wait_seconds",
                        "Seconds that requests waited for tiles which were still to be made, by how that ended.", kTileWaitBounds,
                        {"outcome"}) {
  build_info.set(1, {CORDILLERA_VERSION});
}

KeptCounts ServiceMetrics::kept_counts(const std::string& route) {
  return {requests.at({route, "GET", "200"}), requests.at({route, "GET", "304"}), request_seconds.at({route})};
}

void ServiceMetrics::finished(const Finished& request) {
  requests.add(1, {request.route, known_method(request.method), std::to_string(request.status)});
  request_seconds.observe(request.seconds, {request.route});
  if (request.received > 0) received_bytes.add(static_cast<double>(request.received));
  if (!request.problem.empty()) problems.add(1, {request.problem});
}

std::string ServiceMetrics::text() const {
  std::string out;
  const Family* const all[] = {&build_info,
                               &requests,
                               &request_seconds,
                               &in_flight,
                               &connections,
                               &unsent_bytes,
                               &waiting,
                               &received_bytes,
                               &sent_bytes,
                               &problems,
                               &denied,
                               &uploads,
                               &datasets,
                               &queue_limit,
                               &builds,
                               &build_seconds,
                               &first_tile_seconds,
                               &tile_wait_seconds,
                               &tile_waiting,
                               &live_bytes,
                               &live_forgotten,
                               &live_asked,
                               &stage_seconds,
                               &blocks,
                               &samples,
                               &versions,
                               &device_lost,
                               &store_opens,
                               &store_damaged,
                               &datasets_damaged,
                               &ready,
                               &disk_size,
                               &disk_free,
                               &gpu_memory};
  for (const Family* family : all) family->write(out);
  write_process(out);
  return out;
}

}  // namespace cordillera::server::metrics
