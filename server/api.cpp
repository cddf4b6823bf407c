#include "server/api.h"

#include <algorithm>

#include "server/log.h"
#include "server/openapi.h"
#include "server/options.h"
#include "server/web.h"

namespace cordillera::server {
namespace {

/// Reading is open to every origin. Writing is not announced to foreign pages: a browser then asks first, and is not answered
/// yes.
void add_cors(Response& response) {
  response.set("Access-Control-Allow-Origin", "*");
  response.set("Access-Control-Expose-Headers", "ETag, Location, Content-Length, Retry-After, Server-Timing");
}

Response preflight(Resource resource) {
  Response response;
  response.status = 204;
  response.set("Allow", allowed_methods(resource));
  // A POST of places reads as a GET does; only its body is longer than an address may be.
  const bool asked_by_post = resource == Resource::elevation;
  response.set("Access-Control-Allow-Methods", asked_by_post ? "GET, HEAD, POST, OPTIONS" : "GET, HEAD, OPTIONS");
  response.set("Access-Control-Allow-Headers", std::string("If-None-Match, Range, Cache-Control, Last-Event-ID") + (asked_by_post ? ", Content-Type" : ""));
  response.set("Access-Control-Max-Age", "86400");
  return response;
}

Response method_not_allowed(const Request& request, Resource resource) {
  auto response = problem_response(
      {"method-not-allowed", request.method.substr(0, 20) + " is not possible here", allowed_methods(resource), ""});
  response.set("Allow", allowed_methods(resource));
  return response;
}

bool allowed(const std::string& method, Resource resource) {
  return (", " + allowed_methods(resource) + ",").find(", " + method + ",") != std::string::npos;
}

/// Every path that a dataset has, for the answer to a misspelt one.
std::string face_paths() {
  std::string paths;
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    for (const pipeline::faces::Resource& resource : face->resources) paths.append(", ").append(resource.path);
  }
  return paths;
}

}  // namespace

proto::Problem unknown_dataset(const std::string& id) {
  return {"dataset-unknown", "there is no dataset '" + id + "'", "an id that GET /v1/datasets lists", ""};
}

Response if_changed(const Request& request, Response response) {
  const std::string etag = response.header("ETag");
  const auto wanted = request.header("if-none-match");
  if (response.status != 200 || etag.empty() || !wanted) return response;
  // Tags are hex in quotes, so finding one as a substring is finding it in the list; W/ before it does not matter here.
  if (*wanted != "*" && wanted->find(etag.substr(etag.find('"'))) == std::string::npos) return response;
  Response unchanged;
  unchanged.status = 304;
  for (const char* name : {"ETag", "Cache-Control", "Vary"}) {
    if (const std::string value = response.header(name); !value.empty()) unchanged.set(name, value);
  }
  return unchanged;
}

void mark_variants(Response& response) {
  const std::string type = response.header("Content-Type");
  static const std::vector<std::string> kCompressed = {"text/", "application/json", "application/xml", "image/svg+xml"};
  const bool compressed = std::any_of(kCompressed.begin(), kCompressed.end(), [&](const auto& kind) { return type.rfind(kind, 0) == 0; });
  if (!compressed || type.rfind("text/event-stream", 0) == 0) return;
  response.set("Vary", "Accept-Encoding");
  for (auto& [name, value] : response.headers) {
    if (name == "ETag" && value.rfind("W/", 0) != 0) value.insert(0, "W/");
  }
}

Response Api::handle(const Request& request) {
  const Route route = parse_route(request.path);
  Response response = dispatch(request, route);
  if (route.resource == Resource::face && route.found.resource->links == pipeline::faces::Links::tile_templates) make_absolute(request, response);
  mark_variants(response);
  response = if_changed(request, std::move(response));
  add_cors(response);
  return response;
}

std::optional<Response> Api::refuse_early(const Request& request) {
  const Route route = parse_route(request.path);
  if (request.method != "POST" || route.resource != Resource::datasets) return std::nullopt;
  const auto problem = check_post(service_, request);
  if (!problem) return std::nullopt;
  Response response = problem_response(*problem);
  add_cors(response);
  return response;
}

Response Api::dispatch(const Request& request, const Route& route) {
  if (request.method == "OPTIONS") return preflight(route.resource);
  if (route.resource == Resource::none) {
    return problem_response({"not-found", "there is nothing at " + request.path.substr(0, 200),
                             "/v1/datasets, /v1/datasets/{id} and, below it, events, manifest.json, elevation, mesh.glb (.ply, .obj, .stl)" + face_paths(),
                             ""});
  }
  if (!allowed(request.method, route.resource)) return method_not_allowed(request, route.resource);
  switch (route.resource) {
    case Resource::index:
      return index();
    case Resource::health:
    case Resource::readiness:
      return health(route.resource);
    case Resource::description:
      return api_description();
    case Resource::page:
      return page(service_.settings().serve.web, request.path, service_.registry().list());
    case Resource::datasets:
      return request.method == "POST" ? post_dataset(service_, request) : list(request);
    case Resource::dataset:
      return request.method == "DELETE" ? remove(route.id) : status(route.id);
    default:
      break;
  }
  const auto dataset = service_.registry().find(route.id);
  if (!dataset) return problem_response(unknown_dataset(route.id));
  if (route.resource == Resource::events) return event_stream(service_, *dataset);
  if (route.resource == Resource::elevation) return elevation(service_, *dataset, request, route);
  if (route.resource == Resource::mesh) return extracted_mesh(service_, *dataset, request, route);
  return published(service_, *dataset, request, route);
}

Response Api::index() const {
  Json json;
  json["name"] = "Cordillera";
  json["version"] = CORDILLERA_VERSION;
  json["links"] = {{"datasets", "v1/datasets"}, {"health", "healthz"}, {"readiness", "readyz"}, {"viewer", "."}, {"description", "api"}};
  for (const OptionSpec& option : build_options()) {
    json["options"][spelt(option, Spelling::query)] = {{"help", option.help}, {"accepted", option.accepted}};
  }
  return json_response(200, json);
}

Response Api::health(Resource resource) {
  if (resource == Resource::readiness && service_.stopping()) {
    return problem_response({"service-stopping", "the service is stopping", "", ""});
  }
  Response response = json_response(200, {{"status", "ok"}});
  response.set("Cache-Control", "no-store");
  return response;
}

Response Api::list(const Request& request) {
  if (!request.query.empty()) {
    const std::string& name = request.query.front().first;
    const std::string shown = is_utf8(name) ? name.substr(0, 100) : "(not UTF-8)";
    return problem_response({"option-unknown", "unknown query parameter '" + shown + "'",
                             "no parameters: a GET lists all datasets; options go with a POST", shown});
  }
  Json json;
  json["datasets"] = Json::array();
  for (const Dataset& dataset : service_.registry().list()) {
    json["datasets"].push_back(status_json(service_, dataset, "datasets/" + dataset.id));
  }
  Response response = json_response(200, json);
  response.set("Cache-Control", "no-store");
  return response;
}

Response Api::status(const std::string& id) {
  const auto dataset = service_.registry().find(id);
  if (!dataset) return problem_response(unknown_dataset(id));
  Json json = status_json(service_, *dataset, id);
  if (dataset->state == State::ready) json["faces"] = faces_json(id);
  Response response = json_response(200, json);
  response.set("Cache-Control", "no-store");
  return response;
}

Response Api::remove(const std::string& id) {
  if (!service_.registry().find(id)) return problem_response(unknown_dataset(id));
  service_.registry().remove(id);
  service_.queue().cancel(id);
  service_.hub().forget(id);
  service_.library().forget(id);
  std::error_code error;
  std::filesystem::remove_all(service_.layout().dataset(id), error);
  if (error) log_warning("dataset " + id + ": cannot remove its folder: " + error.message());
  log_info("dataset " + id + ": deleted");
  Response response;
  response.status = 204;
  return response;
}

}  // namespace cordillera::server
