// What the service says of itself.
#include "server/api/api.h"
#include "server/api/public_address.h"
#include "server/api/requests/query_words.h"
#include "server/http/json.h"
#include "server/limits/disk.h"
#include "server/metrics/gpu_memory.h"
#include "server/options/options.h"
#include "server/service/readiness.h"

namespace cordillera::server {
namespace {

Response not_cached(Response response) {
  response.set("Cache-Control", "no-store");
  return response;
}

/// Numbers that are looked up when they are asked for.
void look_around(Service& service) {
  metrics::ServiceMetrics& all = service.metrics();
  const StateCounts counts = service.registry().counts();
  all.datasets.set(static_cast<double>(counts.queued), {"queued"});
  all.datasets.set(static_cast<double>(counts.running), {"running"});
  all.datasets.set(static_cast<double>(counts.ready), {"ready"});
  all.datasets.set(static_cast<double>(counts.failed), {"failed"});
  all.queue_limit.set(service.settings().serve.limits.queue);
  all.changes_waiting.set(static_cast<double>(service.ledger().waiting()));
  all.uploads.set(static_cast<double>(service.admission().in_use().uploads));
  all.datasets_damaged.set(static_cast<double>(service.library().damaged_count()));
  all.waiting.set(service.waiting());
  all.live_bytes.set(static_cast<double>(service.live().bytes()));
  all.tile_waiting.set(service.waiting(Service::WaitsFor::tiles));
  const FrontCounts front = service.front();
  all.connections.set(static_cast<double>(front.connections));
  all.unsent_bytes.set(static_cast<double>(front.unsent_bytes));
  all.ready.set(why_not_ready(service).empty() ? 1 : 0);
  if (const auto disk = limits::disk_space(service.layout().root)) {
    all.disk_size.set(static_cast<double>(disk->size));
    all.disk_free.set(static_cast<double>(disk->free));
  }
  const auto gpus = metrics::gpus();
  for (std::size_t i = 0; i < gpus.size(); ++i) {
    all.gpu_memory.set(static_cast<double>(gpus[i].total), {std::to_string(i), "total"});
    all.gpu_memory.set(static_cast<double>(gpus[i].used), {std::to_string(i), "used"});
  }
}

}  // namespace

Response index(const Request& request) {
  const std::string root = public_prefix(request);
  Json json;
  json["name"] = "Cordillera";
  json["version"] = CORDILLERA_VERSION;
  const std::pair<const char*, const char*> kLinks[] = {
      {"datasets", "/v1/datasets"}, {"limits", "/v1/limits"}, {"stac", "/stac"}, {"health", "/healthz"},
      {"readiness", "/readyz"},     {"metrics", "/metrics"},  {"viewer", "/"},   {"description", "/api"}};
  for (const auto& [name, path] : kLinks) json["links"][name] = root + path;
  for (const auto& option : post_words()) {
    if (option.open_to == OpenTo::operators) continue;
    json["options"][spelt(option.name, Spelling::query)] = {{"help", option.help}, {"accepted", option.accepted}};
  }
  Response response = json_response(200, json);
  response.set("Vary", kAddressHeaders);
  return response;
}

Response alive() { return not_cached(json_response(200, {{"status", "ok"}})); }

Response readiness(Service& service) {
  const std::vector<Reason> reasons = why_not_ready(service);
  // Told, but no reason to send clients elsewhere: all other datasets are served, and work is taken.
  const std::size_t damaged = service.library().damaged_count();
  const Json told = damaged > 0 ? Json{{"damaged_datasets", damaged}} : Json::object();
  if (reasons.empty()) {
    Json json = {{"status", "ok"}};
    json.update(told);
    return not_cached(json_response(200, json));
  }
  std::string detail;
  Json named = Json::array();
  for (const Reason& reason : reasons) {
    detail += (detail.empty() ? "" : "; ") + reason.detail;
    named.push_back(reason.name);
  }
  const Response plain =
      problem_response(service.stopping() ? proto::Problem{"service-stopping", detail, "", ""}
                                          : proto::Problem{"not-ready", detail, "asking again later; reading goes on", ""});
  Json json = Json::parse(plain.body);
  json["reasons"] = named;
  json.update(told);
  Response response = plain;
  response.body = dump(json);
  return response;
}

Response metrics_text(Service& service) {
  look_around(service);
  Response response;
  response.set("Content-Type", "text/plain; version=0.0.4; charset=utf-8");
  response.set("Cache-Control", "no-store");
  response.body = service.metrics().text();
  return response;
}

Response limits_in_effect(Service& service) {
  const limits::InUse now = service.admission().in_use();
  Json json;
  for (const auto& [option, field, unit] : limit_options()) {
    json["limits"][spelt(option.name, Spelling::query)] = {
        {"value", service.settings().serve.limits.*field}, {"unit", unit}, {"about", option.help}};
  }
  const auto add = [&](const char* name, std::uint32_t value, const char* unit, const char* about) {
    json["limits"][name] = {{"value", value}, {"unit", unit}, {"about", about}};
  };
  add("jobs", service.settings().serve.jobs, "builds", "builds that run at the same time");
  add("waiting_clients", kMostWaiting, "clients", "clients that may wait for progress");
  add("waiting_for_tiles", kMostWaitingForTiles, "requests", "requests that may wait for tiles which are still to be made");
  json["in_use"] = {{"max_datasets", now.datasets},
                    {"max_queue", now.queue},
                    {"max_uploads", now.uploads},
                    {"cache_limit", service.live().bytes() >> 20},
                    {"max_unsent", service.front().unsent_bytes >> 20},
                    {"waiting_clients", service.waiting()},
                    {"waiting_for_tiles", service.waiting(Service::WaitsFor::tiles)}};
  return not_cached(json_response(200, json));
}

}  // namespace cordillera::server
