#include "server/api/requests/routes.h"

#include <algorithm>
#include <vector>

#include "pipeline/exports/mesh/mesh_output.h"

namespace cordillera::server {
namespace {

std::vector<std::string_view> split(std::string_view path) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto slash = path.find('/');
    parts.push_back(path.substr(0, slash));
    if (slash == std::string_view::npos) return parts;
    path.remove_prefix(slash + 1);
  }
}

constexpr std::string_view kArchive = ".pmtiles", kLive = "/v1/live";

/// Below /stac: nothing, conformance, collections, collections/datasets, …/items and …/items/{id}.
Route stac_route(std::string_view rest) {
  constexpr std::string_view kItems = "collections/datasets/items/";
  Route route;
  const bool known = rest.empty() || rest == "conformance" || rest == "collections" || rest == "collections/datasets" ||
                     rest == "collections/datasets/items";
  const bool item = rest.starts_with(kItems) && is_id(rest.substr(kItems.size()));
  if (!known && !item) return route;
  route.endpoint = Endpoint::stac;
  route.path = std::string(rest);
  if (item) route.id = std::string(rest.substr(kItems.size()));
  return route;
}

/// What a dataset has and a version of it has not.
bool is_of_now(Endpoint endpoint) {
  return endpoint == Endpoint::events || endpoint == Endpoint::sources || endpoint == Endpoint::source ||
         endpoint == Endpoint::versions || endpoint == Endpoint::rollback || endpoint == Endpoint::demo;
}

Endpoint below_dataset(const std::string& path, pipeline::faces::Found* face) {
  if (path == "events") return Endpoint::events;
  if (path == "manifest.json") return Endpoint::manifest;
  if (path == "sources") return Endpoint::sources;
  if (path.starts_with("sources/") && is_id(path.substr(8))) return Endpoint::source;
  if (path == "versions") return Endpoint::versions;
  if (path == "rollback") return Endpoint::rollback;
  if (path == "elevation") return Endpoint::elevation;
  if (path.starts_with("demo/") && path.ends_with(".html") && is_id(path.substr(5, path.size() - 10))) return Endpoint::demo;
  if (path.starts_with("mesh.") && pipeline::exports::mesh_kind(path.substr(5))) return Endpoint::mesh;
  const auto found = pipeline::faces::find(path);
  if (!found) return Endpoint::none;
  *face = *found;
  return Endpoint::face;
}

/// Behind /v1/live: what a client reads of a dataset. rest: "", ".pmtiles", or "/" and what is below.
Route live_route(std::string_view rest) {
  Route route;
  const bool below = rest.starts_with('/');
  if (below) rest.remove_prefix(1);
  const Endpoint what = rest.empty()                 ? Endpoint::dataset
                        : !below && rest == kArchive ? Endpoint::archive
                        : below                      ? below_dataset(std::string(rest), &route.found)
                                                     : Endpoint::none;
  constexpr Endpoint kRead[] = {Endpoint::dataset,   Endpoint::archive, Endpoint::face, Endpoint::manifest,
                                Endpoint::elevation, Endpoint::events,  Endpoint::mesh};
  if (std::find(std::begin(kRead), std::end(kRead), what) == std::end(kRead)) return {};
  route.endpoint = Endpoint::live;
  route.path = std::string(rest);
  return route;
}

}  // namespace

Route parse_route(std::string_view path) {
  Route route;
  const auto parts = split(path);
  if (path == "/healthz") route.endpoint = Endpoint::health;
  if (path == "/readyz") route.endpoint = Endpoint::readiness;
  if (path == "/api" || path == "/openapi.json") route.endpoint = Endpoint::description;
  if (path == "/metrics") route.endpoint = Endpoint::metrics;
  if (path == "/v1/limits") route.endpoint = Endpoint::limits;
  if (path == "/v1") route.endpoint = Endpoint::index;
  if (path == "/v1/uploads") route.endpoint = Endpoint::uploads;
  if (path == "/v1/datasets") route.endpoint = Endpoint::datasets;
  if (route.endpoint != Endpoint::none) return route;
  if (path == "/stac" || path.starts_with("/stac/")) return stac_route(path.substr(std::min<std::size_t>(6, path.size())));
  if (path.empty() || path[0] != '/') return {};
  if (parts.size() < 2 || parts[1] != "v1") {
    route.endpoint = Endpoint::page;
    return route;
  }
  if (path.starts_with(kLive)) return live_route(path.substr(kLive.size()));
  if (parts.size() == 4 && parts[2] == "uploads" && is_id(parts[3])) {
    route.endpoint = Endpoint::upload;
    route.id = std::string(parts[3]);
    return route;
  }
  if (parts.size() == 4 && parts[2] == "datasets" && parts[3].ends_with(kArchive) &&
      is_id(parts[3].substr(0, parts[3].size() - kArchive.size()))) {
    route.endpoint = Endpoint::archive;
    route.id = std::string(parts[3].substr(0, parts[3].size() - kArchive.size()));
    return route;
  }
  if (parts.size() < 4 || parts[2] != "datasets" || !is_id(parts[3])) return {};
  route.id = std::string(parts[3]);
  if (parts.size() == 4) {
    route.endpoint = Endpoint::dataset;
    return route;
  }
  // What a version names stays as it is for ever, so only what a finished build has goes below one.
  const bool versioned = parts[4] == "versions" && parts.size() > 6 && is_id(parts[5]);
  if (versioned) route.version = std::string(parts[5]);
  const std::string_view rest = parts[versioned ? 6 : 4];
  route.path = path.substr(static_cast<std::size_t>(rest.data() - path.data()));
  route.endpoint = below_dataset(route.path, &route.found);
  if (versioned && is_of_now(route.endpoint)) route.endpoint = Endpoint::none;
  return route;
}

std::string route_name(const Route& route) {
  switch (route.endpoint) {
    case Endpoint::none: return "unknown";
    case Endpoint::index: return "index";
    case Endpoint::health: return "healthz";
    case Endpoint::readiness: return "readyz";
    case Endpoint::description: return "api";
    case Endpoint::metrics: return "metrics";
    case Endpoint::limits: return "limits";
    case Endpoint::live: return "live";
    case Endpoint::uploads: return "uploads";
    case Endpoint::upload: return "upload";
    case Endpoint::datasets: return "datasets";
    case Endpoint::dataset: return "dataset";
    case Endpoint::events: return "events";
    case Endpoint::manifest: return "manifest";
    case Endpoint::sources: return "sources";
    case Endpoint::source: return "source";
    case Endpoint::versions: return "versions";
    case Endpoint::rollback: return "rollback";
    case Endpoint::elevation: return "elevation";
    case Endpoint::mesh: return "mesh";
    case Endpoint::archive: return "archive";
    case Endpoint::stac: return "stac";
    case Endpoint::demo: return "demo";
    case Endpoint::page: return "viewer";
    case Endpoint::face: break;
  }
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    for (const auto& resource : face->resources) {
      if (&resource == route.found.resource) return std::string(face->name);
    }
  }
  return "face";
}

std::string allowed_methods(Endpoint endpoint) {
  switch (endpoint) {
    case Endpoint::datasets: return "GET, HEAD, POST, PUT, OPTIONS";
    case Endpoint::sources:
    case Endpoint::elevation: return "GET, HEAD, POST, OPTIONS";
    case Endpoint::dataset: return "GET, HEAD, PATCH, DELETE, OPTIONS";
    case Endpoint::source: return "GET, HEAD, PUT, DELETE, OPTIONS";
    case Endpoint::rollback:
    case Endpoint::uploads: return "POST, OPTIONS";
    case Endpoint::upload: return "GET, HEAD, PATCH, DELETE, OPTIONS";
    default: return "GET, HEAD, OPTIONS";
  }
}

}  // namespace cordillera::server
