#include "server/api/api.h"

#include <chrono>
#include <cstdlib>

#include "pipeline/store/sqlite.h"
#include "server/api/api_stac.h"
#include "server/api/api_updates.h"
#include "server/api/dataset_list.h"
#include "server/api/documents/browser_pages.h"
#include "server/api/documents/openapi.h"
#include "server/api/documents/web.h"
#include "server/api/requests/delivery.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/http/gzip.h"
#include "server/http/request_id.h"
#include "server/log/log.h"
#include "server/uploads/tus.h"

namespace cordillera::server {
namespace {

constexpr const char* kReadingHeaders = "If-None-Match, If-Range, Range, Cache-Control, Last-Event-ID, Authorization";
constexpr const char* kWritingHeaders =
    "Content-Type, Content-Encoding, Prefer, Idempotency-Key, Tus-Resumable, Upload-Length, Upload-Offset, Upload-Metadata";
constexpr const char* kToldHeaders =
    "Accept-Ranges, Content-Length, Content-Range, Cordillera-Provisional, ETag, Location, Preference-Applied, Retry-After, "
    "Server-Timing, "
    "Tus-Resumable, Upload-Length, Upload-Offset, X-Request-Id";

/// Reading is open to every origin. Without tokens writing is not announced to foreign pages: a browser then asks first, and is
/// not answered yes. With tokens a page needs one, which no browser sends by itself.
void add_cors(Response& response) {
  response.set("Access-Control-Allow-Origin", "*");
  response.set("Access-Control-Expose-Headers", kToldHeaders);
}

enum class Foreign : std::uint8_t { reads, writes };

Response preflight(Endpoint endpoint, Foreign pages) {
  Response response;
  response.status = 204;
  response.set("Allow", allowed_methods(endpoint));
  // A POST of places reads as a GET does; only its body is longer than an address may be.
  const bool asked_by_post = endpoint == Endpoint::elevation;
  const bool all = pages == Foreign::writes || asked_by_post;
  response.set("Access-Control-Allow-Methods", all ? allowed_methods(endpoint) : "GET, HEAD, OPTIONS");
  std::string headers = kReadingHeaders;
  if (pages == Foreign::writes)
    headers.append(", ").append(kWritingHeaders);
  else
    headers.append(asked_by_post ? ", Prefer, Content-Type" : ", Prefer");
  response.set("Access-Control-Allow-Headers", headers);
  response.set("Access-Control-Max-Age", "86400");
  return response;
}

Response method_not_allowed(const Request& request, Endpoint endpoint) {
  // A raster sent to where nothing takes one: who does not know the address is told it.
  const bool sent =
      (request.method == "POST" || request.method == "PUT") && (endpoint == Endpoint::page || endpoint == Endpoint::index);
  auto response = problem_response({"method-not-allowed", request.method.substr(0, 20) + " is not possible here",
                                    allowed_methods(endpoint) + (sent ? "; rasters go to POST /v1/datasets" : ""), ""});
  response.set("Allow", allowed_methods(endpoint));
  return response;
}

bool allowed(const std::string& method, Endpoint endpoint) {
  return (", " + allowed_methods(endpoint) + ",").find(", " + method + ",") != std::string::npos;
}

/// Of what is there now; who looks at a dataset's state does not read it.
bool reads_terrain(const Route& route) {
  const Endpoint what = route.endpoint;
  return route.version.empty() && (what == Endpoint::face || what == Endpoint::manifest || what == Endpoint::elevation ||
                                   what == Endpoint::mesh || what == Endpoint::archive);
}

/// Every path that a dataset has, for the answer to a misspelt one.
std::string face_paths() {
  std::string paths;
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    for (const pipeline::faces::Resource& resource : face->resources) paths.append(", ").append(resource.path);
  }
  return paths;
}

/// The newest, for the page that stands in the viewer's place.
std::vector<Row> newest(Service& service, const Request& request) { return page_of(service, request, {}).rows; }

/// Of answers that are hardly ever asked for twice. Nothing of a dataset stays in the front when the dataset has gone.
std::shared_ptr<const std::string> made_anew(const std::string&, const std::function<std::string()>& make) {
  return std::make_shared<const std::string>(make());
}

/// Room for all of it must be there now: a client that is told "no" after 40 GB has wasted a day.
Response begin_upload(Service& service, const Request& request, const uploads::Bounds& bounds) {
  const std::string announced = request.header("upload-length").value_or("");
  const std::string full =
      announced.size() < 19 ? service.admission().space().full(std::strtoull(announced.c_str(), nullptr, 10)) : "";
  if (!full.empty()) return problem_response(limits::storage_full(full));
  return uploads::begin(service.uploads(), request, bounds);
}

/// A part takes a thread and the disk's time, as a whole raster does, so it needs a place too.
Response upload_in_parts(Service& service, const Request& request, const std::string& id) {
  if (request.method != "PATCH") return uploads::at(service.uploads(), id, request);
  const std::string announced = request.header("content-length").value_or("");
  const std::uint64_t bytes = announced.size() < 19 ? std::strtoull(announced.c_str(), nullptr, 10) : 0;
  const auto place = service.admission().enter(sender(request), bytes, limits::Entry::part);
  if (!place) return problem_response(place.problem());
  std::string full;
  const auto claim = service.admission().space().claim(bytes, &full);
  Response response = claim ? uploads::at(service.uploads(), id, watched(request, *claim, &full)) : Response();
  return full.empty() ? response : problem_response(limits::storage_full(full));
}

}  // namespace

proto::Problem unknown_to(const Request& request, const std::string& id) {
  proto::Problem problem = unknown_dataset(id);
  if (request.who.role >= access::Role::read) return problem;
  problem.detail += " that may be read without a token";
  problem.accepted += "; for a private one a header Authorization: Bearer TOKEN";
  return problem;
}

void keep_from_others(Response& response) {
  for (auto& [name, value] : response.headers) {
    if (name == "Cache-Control" && value.rfind("public", 0) == 0) value.replace(0, 6, "private");
  }
}

bool names_tag(const std::string& if_none_match, const std::string& tag) {
  // Tags are hex in quotes, so finding one as a substring is finding it in the list; W/ before it does not matter here.
  return if_none_match == "*" || if_none_match.find(std::string_view(tag).substr(tag.find('"'))) != std::string::npos;
}

Response if_changed(const Request& request, Response response) {
  const std::string etag = response.header("ETag");
  const auto wanted = request.header("if-none-match");
  if (response.status != 200 || etag.empty() || !wanted) return response;
  if (!names_tag(*wanted, etag)) return response;
  Response unchanged;
  unchanged.status = 304;
  for (const auto& [name, value] : response.headers) {  // Vary may be there twice
    if (name == "ETag" || name == "Cache-Control" || name == "Vary") unchanged.set(name, value);
  }
  return unchanged;
}

void mark_variants(Response& response) {
  if (!is_compressible(response.header("Content-Type"))) return;
  response.set("Vary", "Accept-Encoding");
  for (auto& [name, value] : response.headers) {
    if (name == "ETag" && value.rfind("W/", 0) != 0) value.insert(0, "W/");
  }
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
  const auto asked = std::make_shared<Asked>();
  asked->request = std::move(request);
  service_.metrics().in_flight.add(1);
  asked->in_flight = {this, [](void* api) { static_cast<Api*>(api)->service_.metrics().in_flight.add(-1); }};
  asked->request.id = request_id_of(asked->request);
  asked->route = route_meant(asked->request);
  const LogScope scope("request", asked->request.id);
  if (auto& read = asked->request.read_body) {
    const bool keeps = asked->route.endpoint == Endpoint::elevation && asked->request.headers.contains("prefer");
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
  const bool open = request.method == "OPTIONS" || only_reads(request.method, route.endpoint);
  const bool inner = route.endpoint == Endpoint::metrics && service_.gate().has_tokens();
  return service_.gate().refuse(request, !open ? access::Role::write : inner ? access::Role::read : access::Role::none);
}

Response Api::answer(Request& request, const Route& route) {
  try {
    const auto refused = admit(request, route);
    return refused ? problem_response(*refused) : dispatch(request, route);
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
  if (route.endpoint == Endpoint::face && route.found.resource->links == pipeline::faces::Links::tile_templates)
    make_absolute(asked->request, response);
  mark_variants(response);
  response = if_changed(asked->request, std::move(response));
  add_cors(response);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - asked->start;
  finish(service_, {asked->request, route, asked->received, took.count()}, response);
  return response;
}

/// Who may what and which datasets there are is looked up once more: it may be minutes later.
Response Api::asked_anew(const std::shared_ptr<Asked>& asked, Response response) {
  Response put_off;
  put_off.rest = [this, asked, told = std::move(response.headers)] {
    const LogScope scope("request", asked->request.id);
    asked->request.waited = true;
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
}

bool Api::is_quick(const Request& request) const {
  if (request.method == "OPTIONS") return true;
  if (request.method != "GET" && request.method != "HEAD") return false;
  const Route route = parse_route(request.path);
  const bool here = !service_.mounts().has(route.id);  // who waits for a storage is not quick
  // A .glb is made when it is asked for; those asked for lately are kept and given before anybody asks here.
  const bool stored = route.endpoint == Endpoint::face && route.found.resource->path == "tiles/{z}/{x}/{y}.drc" && here;
  return stored || route.endpoint == Endpoint::health || route.endpoint == Endpoint::readiness ||
         route.endpoint == Endpoint::events;
}

Response Api::dispatch(const Request& request, const Route& route) {
  const uploads::Bounds bounds{std::uint64_t{service_.settings().serve.limits.body_mib} << 20, sender(request)};
  if (request.method == "OPTIONS") {
    Response response = preflight(route.endpoint, service_.gate().has_tokens() ? Foreign::writes : Foreign::reads);
    if (route.endpoint == Endpoint::uploads || route.endpoint == Endpoint::upload) uploads::announce(response, bounds);
    return response;
  }
  if (route.endpoint == Endpoint::none || route.endpoint == Endpoint::page) {
    if (auto moved = without_slash(request, [](const std::string& path) { return browser_page(path).has_value(); }))
      return *moved;
  }
  if (route.endpoint == Endpoint::none) {
    return problem_response({"not-found", "there is nothing at " + request.path.substr(0, 200),
                             "/v1/live, /v1/datasets, /v1/datasets/{id}, /v1/datasets/{id}.pmtiles and, below the dataset, "
                             "events, sources, versions, manifest.json, "
                             "elevation, demo/{client}.html, mesh.glb (.ply, .obj, .stl)" +
                                 face_paths(),
                             ""});
  }
  if (!allowed(request.method, route.endpoint)) return method_not_allowed(request, route.endpoint);
  switch (route.endpoint) {
    case Endpoint::index: return index(request);
    case Endpoint::health: return alive();
    case Endpoint::readiness: return readiness(service_);
    case Endpoint::metrics: return metrics_text(service_);
    case Endpoint::limits: return limits_in_effect(service_);
    case Endpoint::description: return api_description();
    case Endpoint::stac: return stac::answer(service_, request, route);
    case Endpoint::page:
      if (auto small = browser_page(request.path)) return *small;
      return page(service_.web_files(), service_.settings().serve.web, request, [&] { return newest(service_, request); });
    case Endpoint::demo: return demo_page(service_.web_files(), service_.settings().serve.web, route.path);
    case Endpoint::live: {
      const Live live = live_dataset(service_, request, route);
      return live.answer ? *live.answer : of_dataset(live.request, live.route);
    }
    case Endpoint::uploads: return begin_upload(service_, request, bounds);
    case Endpoint::upload: return upload_in_parts(service_, request, route.id);
    case Endpoint::datasets:
      return request.method == "POST" || request.method == "PUT" ? post_dataset(service_, request)
                                                                 : dataset_list(service_, request);
    default: return of_dataset(request, route);
  }
}

Response Api::of_dataset(const Request& request, const Route& route) {
  const std::uint64_t state = this->state();  // before anything is looked at
  const Row dataset = service_.find(route.id);
  // One answer for both, and one way to it: else anybody could find out which private ids there are.
  if (!dataset || !may_see(request, *dataset)) return problem_response(unknown_to(request, route.id));
  if (route.endpoint == Endpoint::dataset && request.method == "DELETE") return remove_dataset(service_, request, *dataset);
  if (route.endpoint == Endpoint::dataset && request.method == "PATCH") return describe_dataset(service_, request, *dataset);
  if (route.endpoint == Endpoint::dataset) return status_document(service_, request, *dataset);
  if (reads_terrain(route) && !request.waited && service_.live().read(*dataset, sender(request))) {
    const Row now = service_.find(route.id);  // it may have been woken
    if (auto later = now ? wait_until_read(service_, request, *now, route) : std::nullopt) return *later;
  }
  const auto read = [&]() -> Response {
    if (route.endpoint == Endpoint::rollback) return updates::rollback(service_, request, *dataset);
    if (route.endpoint == Endpoint::events) return event_stream(service_, request, *dataset);
    if (route.endpoint == Endpoint::elevation) return elevation(service_, *dataset, request, route);
    if (route.endpoint == Endpoint::sources || route.endpoint == Endpoint::source)
      return updates::sources(service_, request, *dataset, route);
    if (route.endpoint == Endpoint::versions) return updates::versions(service_, *dataset);
    if (route.endpoint == Endpoint::mesh) return extracted_mesh(service_, *dataset, request, route);
    if (route.endpoint == Endpoint::archive) return archive(service_, request, *dataset, route);
    const std::string folder = service_.mounts().has(dataset->id) ? service_.mounts().folder(dataset->id) : "";
    return folder.empty() ? published(service_, *dataset, request, route) : published_folder(service_, *dataset, route, folder);
  };
  Response response;
  try {
    response = service_.mounts().has(dataset->id) ? of_mount(service_.mounts(), dataset->id, read) : read();
  } catch (const pipeline::StoreError& error) {
    response = problem_response(service_.library().damaged(dataset->id, error.what()));
  }
  if (dataset->is_private) keep_from_others(response);
  if (!response.keep) response.keep = made_anew;
  const bool plain = dataset->state == State::ready && dataset->address.empty() && !dataset->is_private &&
                     !service_.mounts().has(dataset->id) && route.version.empty() && !logs_debug();
  if (plain && route.endpoint == Endpoint::face && route.found.resource->tag != nullptr && response.shared) {
    response.same_while = state;
    response.counts = std::make_shared<const metrics::KeptCounts>(service_.metrics().kept_counts(route_name(route)));
  }
  return response;
}

}  // namespace cordillera::server
