#include "server/metrics/service_metrics.h"

namespace cordillera::server::metrics {
namespace {

/// Methods that somebody made up are one.
std::string_view known_method(std::string_view method) {
  for (const std::string_view known : {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}) {
    if (method == known) return known;
  }
  return "other";
}

}  // namespace

ServiceMetrics::ServiceMetrics() { build_info.set(1, {CORDILLERA_VERSION}); }

KeptCounts ServiceMetrics::kept_counts(const std::string& route) {
  return {requests.at({route, "GET", "200"}), requests.at({route, "GET", "304"}), request_seconds.at({route})};
}

void ServiceMetrics::finished(const Finished& request) {
  requests.add(1, {request.route, known_method(request.method), std::to_string(request.status)});
  request_seconds.observe(request.seconds, {request.route});
  if (request.received > 0) received_bytes.add(static_cast<double>(request.received));
  if (!request.problem.empty()) problems.add(1, {request.problem});
}

void ServiceMetrics::refused(const Finished& request) {
  requests.add(1, {request.route, known_method(request.method), std::to_string(request.status)});
  problems.add(1, {request.problem});
}

std::string ServiceMetrics::text() const {
  std::string out;
  all_.write(out);
  write_process(out);
  return out;
}

}  // namespace cordillera::server::metrics
