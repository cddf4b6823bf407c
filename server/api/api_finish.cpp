// What stands in every answer, and what is told of it.
#include "server/access/audit.h"
#include "server/access/safe_headers.h"
#include "server/api/api.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

/// Into a problem that has been written already, as its last member. The id has no character that JSON would escape.
void name_request(Response& response, const std::string& id) {
  const auto end = response.body.rfind('}');
  if (end == std::string::npos) return;
  response.body.resize(response.body.find_last_not_of(" \n", end - 1) + 1);
  response.body += ",\n  \"request_id\": \"" + id + "\"\n}\n";
}

/// The dataset that a request made or was about.
std::string dataset_of(const Exchange& exchange, const Response& response) {
  if (!exchange.route.id.empty()) return exchange.route.id;
  const std::string location = response.header("Location");
  return location.substr(location.rfind('/') + 1);
}

void note(access::Audit& audit, const Exchange& exchange, const Response& response) {
  const Request& request = exchange.request;
  audit.note({request.who.name, request.client, request.method, request.path, dataset_of(exchange, response), exchange.received,
              response.status, response.problem, request.id});
}

/// Who was turned away at the gate. That goes into the log and not into the audit, which strangers could fill.
bool turned_away(const Response& response) {
  return response.problem == "token-missing" || response.problem == "token-invalid" || response.problem == "origin-forbidden" ||
         response.problem == "role-too-low";
}

void log(const Exchange& exchange, const Response& response) {
  const Request& request = exchange.request;
  const bool writes = !only_reads(request.method, exchange.route), broken = response.status >= 500 && response.status != 503;
  const bool notable = writes || turned_away(response);
  if (!broken && !notable && !logs_debug()) return;
  LogFields fields = {{"client", request.client},
                      {"method", request.method.substr(0, 20)},
                      {"path", request.path.substr(0, 300)},
                      {"status", std::int64_t{response.status}},
                      {"seconds", exchange.seconds},
                      {"sent", static_cast<std::int64_t>(response.bytes().size())}};
  if (exchange.received > 0) fields.push_back(LogField{"received", static_cast<std::int64_t>(exchange.received)});
  if (!request.who.name.empty()) fields.push_back(LogField{"who", request.who.name});
  if (!response.problem.empty()) fields.push_back(LogField{"problem", response.problem});
  if (broken) return log_warning("request", fields);
  if (notable) return log_info("request", fields);
  log_debug("request", fields);
}

}  // namespace

bool may_see(const Request& request, const Dataset& dataset) { return !dataset.is_private || request.who.reads_private(); }

void finish(Service& service, const Exchange& exchange, Response& response) {
  const Request& request = exchange.request;
  if (response.header("Content-Type") == "application/problem+json") name_request(response, request.id);
  if (const std::string challenge = access::challenge_of(response.problem); !challenge.empty())
    response.set("WWW-Authenticate", challenge);
  response.set("X-Request-Id", request.id);
  access::add_safe_headers(response);
  const bool refused = turned_away(response);
  if (refused) service.metrics().denied.add(1, {response.problem});
  if (!refused && !only_reads(request.method, exchange.route)) note(service.audit(), exchange, response);
  log(exchange, response);
  service.metrics().finished(
      {route_name(exchange.route), request.method, response.status, exchange.seconds, exchange.received, response.problem});
  response.counted = true;
}

}  // namespace cordillera::server
