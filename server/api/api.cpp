#include "server/api/api.h"

#include <chrono>

#include "pipeline/faces/draco_tiles.h"
#include "server/api/api_updates.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/http/conditions.h"
#include "server/http/gzip.h"
#include "server/http/request_id.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

constexpr const char* kReadingHeaders = "If-Match, If-None-Match, If-Range, Range, Cache-Control, Last-Event-ID, Authorization";
constexpr const char* kWritingHeaders =
    "Content-Type, Content-Encoding, Prefer, Idempotency-Key, Tus-Resumable, Upload-Length, Upload-Offset, Upload-Metadata";
constexpr const char* kToldHeaders =
    "Accept-Ranges, Content-Length, Content-Location, Content-Range, Cordillera-Hint, Cordillera-Provisional, ETag, Location, "
    "Preference-Applied, "
    "Retry-After, Server-Timing, Tus-Resumable, Upload-Length, Upload-Offset, X-Request-Id";

enum class Foreign : std::uint8_t { reads, writes };

Response preflight(const Route& route, Foreign pages) {
  Response response;
  response.status = 204;
  response.set("Allow", allowed_methods(route));
  // A POST of places reads as a GET does; only its body is longer than an address may be.
  const bool asked_by_post = only_reads("POST", route);
  const bool all = pages == Foreign::writes || asked_by_post;
  response.set("Access-Control-Allow-Methods", all ? allowed_methods(route) : "GET, HEAD, OPTIONS");
  std::string headers = kReadingHeaders;
  if (pages == Foreign::writes)
    headers.append(", ").append(kWritingHeaders);
  else
    headers.append(asked_by_post ? ", Prefer, Content-Type" : ", Prefer");
  response.set("Access-Control-Allow-Headers", headers);
  response.set("Access-Control-Max-Age", "86400");
  return response;
}

Response method_not_allowed(const Request& request, const Route& route) {
  // A raster sent to where nothing takes one: who does not know the address is told it.
  const bool sent = (request.method == "POST" || request.method == "PUT") && route.is(RouteRow::kTried);
  // curl -T dem URL/ puts to a path that may as well be a dataset's.
  const bool named = request.method == "PUT" && route.row->path == kOneDataset;
  const char* rasters = sent    ? "; rasters go to POST /v1/datasets"
                        : named ? "; a raster whose name has no ending, such as .tif, goes to PUT /v1/datasets?name=NAME"
                                : "";
  auto response = problem_response(
      {"method-not-allowed", request.method.substr(0, 20) + " is not possible here", allowed_methods(route) + rasters, ""});
  response.set("Allow", allowed_methods(route));
  return response;
}

/// Every path of the API, for the answer to a misspelt one.
std::string known_paths() {
  std::string whole, below;
  for (const RouteRow& row : route_table()) {
    if (!row.path.starts_with("/v1") || row.path.ends_with(kOfFaces)) continue;
    const bool of_dataset = row.path.starts_with(kOneDataset) && row.path.substr(kOneDataset.size()).starts_with('/');
    std::string& list = of_dataset ? below : whole;
    list.append(list.empty() ? "" : ", ").append(row.path.substr(of_dataset ? kOneDataset.size() + 1 : 0));
  }
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    for (const pipeline::faces::Resource& resource : face->resources) below.append(", ").append(resource.path);
  }
  return whole + " and, below the dataset, " + below;
}

/// What is read is read only as If-Match has it (RFC 9110, 13.2.1): who goes on with a download must not get two halves.
Response if_matched(const Request& request, Response response) {
  const bool good = response.status / 100 == 2 || response.status == 304;
  if (!good || request.method == "OPTIONS" || if_match_holds(request, response.header("ETag"))) return response;
  return problem_response(condition_failed("If-Match", response.header("ETag")));
}

/// What is there before a change: a GET of the same address, or of the versions where that has none.
Response before_change(Service& service, const Request& request, const Route& route) {
  Request get = request;
  get.method = "GET";
  get.query.clear();
  get.read_body = nullptr;
  for (const char* header : {"if-match", "if-none-match", "if-range", "range", "prefer"}) get.headers.erase(header);
  if (const RouteMethod* method = route.row->method("GET")) return method->handler(service, get, route);
  const Row dataset = service.find(route.id);
  return dataset ? updates::versions(service, get, *dataset) : problem_response(unknown_to(request, route.id));
}

/// Why a change is not made: what it is of is not as its conditions say. Who may not make it is told that instead, by the
/// handler.
std::optional<Response> not_as_said(Service& service, const Request& request, const Route& route) {
  const auto none_match = request.header("if-none-match");
  if (request.waited || (!none_match && !request.headers.contains("if-match"))) return std::nullopt;
  if (!route.row->path.starts_with(kOneDataset)) {  // uploads and the list have no tag
    if (if_match_holds(request, "")) return std::nullopt;
    return problem_response(condition_failed("If-Match", ""));
  }
  const Row dataset = service.find(route.id);
  if (!dataset || !may_see(request, *dataset) || dataset->mounted || updates::refuse(request, *dataset)) return std::nullopt;
  const Response now = before_change(service, request, route);
  if (now.status == 404 || updates::is_repeated(service, request, *dataset)) return std::nullopt;
  const std::string tag = now.header("ETag");
  if (!if_match_holds(request, tag)) return problem_response(condition_failed("If-Match", tag));
  const bool named = none_match && (*none_match == "*" || (!tag.empty() && names_tag(*none_match, tag)));
  return named ? std::optional(problem_response(condition_failed("If-None-Match", tag))) : std::nullopt;
}

}  // namespace

/// Without tokens writing is not announced to foreign pages: a browser then asks first, and is not answered yes. With tokens a
/// page needs one, which no browser sends by itself.
void add_cors(Response& response) {
  response.set("Access-Control-Allow-Origin", "*");
  response.set("Access-Control-Expose-Headers", kToldHeaders);
}

proto::Problem unknown_to(const Request& request, const std::string& id) {
  proto::Problem problem = unknown_dataset(id);
  if (request.who.role >= access::Role::read) return problem;  // by --insecure-writes, too: there is no token to be had
  problem.detail += " that may be read without a token";
  problem.accepted += "; for a private one a header Authorization: Bearer TOKEN";
  return problem;
}

void keep_from_others(Response& response) {
  for (auto& [name, value] : response.headers) {
    if (name == "Cache-Control" && value.rfind("public", 0) == 0) value.replace(0, 6, "private");
  }
  response.set("Vary", "Authorization, Origin, Sec-Fetch-Site");  // a browser keeps them for pages of all ports of this machine
}

Response if_changed(const Request& request, Response response) {
  const std::string etag = response.header("ETag");
  const auto wanted = request.header("if-none-match");
  if (response.status != 200 || etag.empty() || !wanted) return response;
  if (!names_tag(*wanted, etag)) return response;
  Response unchanged;
  unchanged.status = 304;
  for (const auto& [name, value] : response.headers) {  // Vary may be there twice
    if (name == "ETag" || name == "Cache-Control" || name == "Vary" || name == "Accept-Ranges") unchanged.set(name, value);
  }
  return unchanged;
}

void mark_variants(Response& response) {
  if (!is_compressible(response.header("Content-Type"))) return;
  response.set("Vary", "Accept-Encoding");
  if (is_guarded(response)) return;  // each coding has a tag of its own
  for (auto& [name, value] : response.headers) {
    if (name == "ETag" && value.rfind("W/", 0) != 0) value.insert(0, "W/");
  }
}

/// Whatever was made of the part of the body that could be read.
proto::Problem misread_body(const Request& request) {
  const std::string coding = coding_of(request.header("content-encoding").value_or(""));
  return {"coding-invalid", "the body is not " + coding + " from its first byte to its last, as its Content-Encoding says",
          "a body in that coding, where deflate is with zlib's header; or no Content-Encoding", "Content-Encoding"};
}

/// A request on its way, until its answer has come.
struct Api::Asked {
  Request request;
  Route route;
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
  std::uint64_t received = 0;
  std::string body;                 ///< of a query that may wait: it is asked again
  std::shared_ptr<void> in_flight;  ///< counted as long as it lives
};

Response Api::handle(Request request) {
  Route route = route_meant(request);
  return handle(std::move(request), std::move(route));
}

Response Api::handle(Request request, Route route) {
  const auto asked = std::make_shared<Asked>();
  asked->request = std::move(request);
  service_.metrics().in_flight.add(1);
  asked->in_flight = {this, [](void* api) { static_cast<Api*>(api)->service_.metrics().in_flight.add(-1); }};
  asked->request.id = request_id_of(asked->request);
  asked->route = std::move(route);
  const LogScope scope("request", asked->request.id);
  if (auto& read = asked->request.read_body) {
    const bool keeps = only_reads(asked->request.method, asked->route) && asked->request.headers.contains("prefer");
    read = [counted = std::move(read), to = asked.get(), keeps](const Request::Sink& sink) {
      return counted([&](std::string_view piece) {
        to->received += piece.size();
        if (keeps) to->body.append(piece);
        return sink(piece);
      });
    };
  }
  return finished(asked, answer(asked->request, asked->route));
}

std::optional<proto::Problem> Api::admit(Request& request, const Route& route) {
  const auto identity = service_.gate().identify(request);
  if (!identity) return identity.problem();
  request.who = *identity;
  return service_.gate().refuse(request, role_needed(request.method, route));
}

Response Api::answer(Request& request, const Route& route) {
  try {
    const auto refused = admit(request, route);
    if (refused) return problem_response(*refused);
    Response response = dispatch(request, route);
    const bool misread = request.misread && *request.misread;
    return misread && response.status / 100 == 4 ? problem_response(misread_body(request)) : response;
  } catch (const RegistryError& error) {
    log_warning(error.what());
    return problem_response({"storage-full",
                             "the service cannot read or write what it knows of its datasets; nothing was changed",
                             "trying again later", ""});
  } catch (const std::exception& error) {
    log_warning(std::string("the request failed: ") + error.what());
    return problem_response({"internal", "the service failed to answer this request", "", ""});
  }
}

/// What belongs to every answer, also to those that come later.
Response Api::finished(const std::shared_ptr<Asked>& asked, Response response) {
  asked->request.read_body = nullptr;  // what it reads may be gone when the answer comes
  if (response.later) {
    response.later = [this, asked, later = std::move(response.later)](Patience patience) -> std::optional<Response> {
      const LogScope scope("request", asked->request.id);
      auto come = later(patience);
      return come ? std::optional(finished(asked, std::move(*come))) : std::nullopt;
    };
    return response;
  }
  if (response.anew) return asked_anew(asked, std::move(response));
  const Route& route = asked->route;
  if (route.found.resource != nullptr && route.found.resource->links == pipeline::faces::Links::tile_templates)
    make_absolute(asked->request, response);
  mark_variants(response);
  if (only_reads(asked->request.method, route)) response = if_matched(asked->request, std::move(response));
  response = if_changed(asked->request, std::move(response));
  add_cors(response);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - asked->start;
  finish(service_, {asked->request, route, asked->received, took.count()}, response);
  return response;
}

/// Who may what and which datasets there are is looked up once more: it may be minutes later.
Response Api::asked_anew(const std::shared_ptr<Asked>& asked, Response response) {
  Response put_off;
  put_off.rest = [this, asked, told = std::move(response.headers), ends = response.wait_ends] {
    const LogScope scope("request", asked->request.id);
    asked->request.waited = true;
    asked->request.wait_ends = ends;
    asked->request.read_body = [whole = asked.get()](const Request::Sink& sink) {
      return whole->body.empty() || sink(whole->body);
    };
    Response come = answer(asked->request, asked->route);
    come.headers.insert(come.headers.end(), told.begin(), told.end());
    return finished(asked, std::move(come));
  };
  return put_off;
}

void Api::given_again(const Request& request, const metrics::KeptCounts& counts, Response& response) {
  response.set("X-Request-Id", request_id_of(request));
  (response.status == 304 ? counts.unchanged : counts.whole) += 1;
  counts.seconds.observe(0);  // a microsecond or so: not worth two looks at the clock
  response.counted = true;
}

bool Api::is_quick(const Request& request, const Route& route) const {
  if (request.method == "OPTIONS") return true;
  if (request.method != "GET" && request.method != "HEAD") return false;
  // A .glb is made when it is asked for; those asked for lately are kept and given before anybody asks here.
  const bool stored = route.found.resource == pipeline::faces::draco_tiles().resources.data();
  // Who waits for a storage is not quick.
  return stored ? !service_.mounts().has(route.id) : route.is(RouteRow::kQuick);
}

Response Api::dispatch(const Request& request, const Route& route) {
  if (request.method == "OPTIONS") {
    Response response = preflight(route, service_.gate().has_tokens() ? Foreign::writes : Foreign::reads);
    if (route.is(RouteRow::kTus)) uploads::announce(response, upload_bounds(service_.settings().serve.limits, request));
    return response;
  }
  if (route.row == nullptr || route.is(RouteRow::kElsewhere)) {
    if (auto moved = without_slash(request)) return *moved;
  }
  if (route.row == nullptr)
    return problem_response({"not-found", "there is nothing at " + request.path.substr(0, 200), known_paths(), ""});
  const RouteMethod* method = route.row->method(request.method);
  if (method == nullptr) return method_not_allowed(request, route);
  auto refused = only_reads(request.method, route) ? std::nullopt : not_as_said(service_, request, route);
  return refused ? std::move(*refused) : method->handler(service_, request, route);
}

}  // namespace cordillera::server
