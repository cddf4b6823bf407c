#include "server/front/shared.h"

#include <algorithm>

#include "proto/cores.h"
#include "server/http/conditions.h"
#include "server/log/log.h"
#include "server/memory/heap.h"

namespace cordillera::server::front {
namespace {

std::size_t cores() { return std::clamp<std::size_t>(proto::usable_cores(), 1, 64); }

}  // namespace

Shared::Shared(Api& api_, const HttpLimits& limits_, OnServed on_served_)
    : api(api_),
      limits(limits_),
      on_served(std::move(on_served_)),
      unsent(limits_.unsent, limits_.unsent_per_client),
      makers(cores() * 2, limits_.connections * std::size_t{2}, limits_.connections * std::size_t{2}),
      takers(limits_.uploads, limits_.uploads, limits_.uploads_per_client) {}

std::optional<Response> kept_answer(Shared& shared, const Request& request) {
  if (!takes_kept(request)) return std::nullopt;
  const auto kept = shared.kept.find(request.path, shared.api.state());
  if (!kept) return std::nullopt;
  Response response;
  const auto wanted = request.headers.find("if-none-match");
  if (wanted != request.headers.end() && names_tag(wanted->second, kept->etag)) {
    response.status = 304;
    response.lines = kept->unchanged;
  } else {
    response.lines = kept->lines;
    response.shared = kept->body;
  }
  shared.api.given_again(request, *kept->counts, response);
  return response;
}

proto::Problem too_much_unsent() {
  return {"service-busy", "too many large answers wait to be read, of this address or in all",
          "reading those first, or asking again later", ""};
}

Response refusal(const proto::Problem& problem) {
  Response response = problem_response(problem);
  add_cors(response);
  return response;
}

namespace {

/// Whatever is thrown becomes a problem.
Response ready(Shared& shared, const Request& request, const std::function<Response()>& make) {
  keep_reserve();  // of the answer before, which may have found no memory
  if (!has_memory(kForARequest_bytes)) {
    return refusal(
        {"service-busy", "the service has hardly any memory left", "asking again later, or starting it with more", ""});
  }
  try {
    Response response = make();
    shared.coder.encode(request, response);
    if (response.same_while && takes_kept(request)) shared.kept.keep(request.path, response);
    return response;
  } catch (const std::exception& error) {
    log_warning(request.method + " " + request.path.substr(0, 300) + ": " + error.what());
    return refusal({"internal", "the service failed to answer this request", "", ""});
  }
}

}  // namespace

Response answer_of(Shared& shared, const Request& request, const Route& route) {
  return ready(shared, request, [&] { return shared.api.handle(request, route); });
}

Response rest_of(Shared& shared, const Request& request, const std::function<Response()>& rest) {
  return ready(shared, request, rest);
}

}  // namespace cordillera::server::front
