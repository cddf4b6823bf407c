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
  route.resource = Resource::stac;
  route.path = std::string(rest);
  if (item) route.id = std::string(rest.substr(kItems.size()));
  return route;
}

/// What a dataset has and a version of it has not.
bool is_of_now(Resource resource) {
  return resource == Resource::events || resource == Resource::sources || resource == Resource::source ||
         resource == Resource::versions || resource == Resource::rollback || resource == Resource::demo;
}

Resource below_dataset(const std::string& path, pipeline::faces::Found* face) {
  if (path == "events") return Resource::events;
  if (path == "manifest.json") return Resource::manifest;
  if (path == "sources") return Resource::sources;
  if (path.starts_with("sources/") && is_id(path.substr(8))) return Resource::source;
  if (path == "versions") return Resource::versions;
  if (path == "rollback") return Resource::rollback;
  if (path == "elevation") return Resource::elevation;
  if (path.starts_with("demo/") && path.ends_with(".html") && is_id(path.substr(5, path.size() - 10))) return Resource::demo;
  if (path.starts_with("mesh.") && pipeline::exports::mesh_kind(path.substr(5))) return Resource::mesh;
  const auto found = pipeline::faces::find(path);
  if (!found) return Resource::none;
  *face = *found;
  return Resource::face;
}

/// Behind /v1/live: what a client reads of a dataset. rest: "", ".pmtiles", or "/" and what is below.
Route live_route(std::string_view rest) {
  Route route;
  const bool below = rest.starts_with('/');
  if (below) rest.remove_prefix(1);
  const Resource what = rest.empty()                 ? Resource::dataset
                        : !below && rest == kArchive ? Resource::archive
                        : below                      ? below_dataset(std::string(rest), &route.found)
                                                     : Resource::none;
  constexpr Resource kRead[] = {Resource::dataset,   Resource::archive, Resource::face, Resource::manifest,
                                Resource::elevation, Resource::events,  Resource::mesh};
  if (std::find(std::begin(kRead), std::end(kRead), what) == std::end(kRead)) return {};
  route.resource = Resource::live;
  route.path = std::string(rest);
  return route;
}

}  // namespace

Route parse_route(std::string_view path) {
  Route route;
  const auto parts = split(path);
  if (path == "/healthz") route.resource = Resource::health;
  if (path == "/readyz") route.resource = Resource::readiness;
  if (path == "/api" || path == "/openapi.json") route.resource = Resource::description;
  if (path == "/metrics") route.resource = Resource::metrics;
  if (path == "/v1/limits") route.resource = Resource::limits;
  if (path == "/v1") route.resource = Resource::index;
  if (path == "/v1/uploads") route.resource = Resource::uploads;
  if (path == "/v1/datasets") route.resource = Resource::datasets;
  if (route.resource != Resource::none) return route;
  if (path == "/stac" || path.starts_with("/stac/")) return stac_route(path.substr(std::min<std::size_t>(6, path.size())));
  if (path.empty() || path[0] != '/') return {};
  if (parts.size() < 2 || parts[1] != "v1") {
    route.resource = Resource::page;
    return route;
  }
  if (path.starts_with(kLive)) return live_route(path.substr(kLive.size()));
  if (parts.size() == 4 && parts[2] == "uploads" && is_id(parts[3])) {
    route.resource = Resource::upload;
    route.id = std::string(parts[3]);
    return route;
  }
  if (parts.size() == 4 && parts[2] == "datasets" && parts[3].ends_with(kArchive) &&
      is_id(parts[3].substr(0, parts[3].size() - kArchive.size()))) {
    route.resource = Resource::archive;
    route.id = std::string(parts[3].substr(0, parts[3].size() - kArchive.size()));
    return route;
  }
  if (parts.size() < 4 || parts[2] != "datasets" || !is_id(parts[3])) return {};
  route.id = std::string(parts[3]);
  if (parts.size() == 4) {
    route.resource = Resource::dataset;
    return route;
  }
  // What a version names stays as it is for ever, so only what a finished build has goes below one.
  const bool versioned = parts[4] == "versions" && parts.size() > 6 && is_id(parts[5]);
  if (versioned) route.version = std::string(parts[5]);
  const std::string_view rest = parts[versioned ? 6 : 4];
  route.path = path.substr(static_cast<std::size_t>(rest.data() - path.data()));
  route.resource = below_dataset(route.path, &route.found);
  if (versioned && is_of_now(route.resource)) route.resource = Resource::none;
  return route;
}

std::string route_name(const Route& route) {
  switch (route.resource) {
    case Resource::none: return "unknown";
    case Resource::index: return "index";
    case Resource::health: return "healthz";
    case Resource::readiness: return "readyz";
    case Resource::description: return "api";
    case Resource::metrics: return "metrics";
    case Resource::limits: return "limits";
    case Resource::live: return "live";
    case Resource::uploads: return "uploads";
    case Resource::upload: return "upload";
    case Resource::datasets: return "datasets";
    case Resource::dataset: return "dataset";
    case Resource::events: return "events";
    case Resource::manifest: return "manifest";
    case Resource::sources: return "sources";
    case Resource::source: return "source";
    case Resource::versions: return "versions";
    case Resource::rollback: return "rollback";
    case Resource::elevation: return "elevation";
    case Resource::mesh: return "mesh";
    case Resource::archive: return "archive";
    case Resource::stac: return "stac";
    case Resource::demo: return "demo";
    case Resource::page: return "viewer";
    case Resource::face: break;
  }
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    for (const auto& resource : face->resources) {
      if (&resource == route.found.resource) return std::string(face->name);
    }
  }
  return "face";
}

std::string allowed_methods(Resource resource) {
  switch (resource) {
    case Resource::datasets: return "GET, HEAD, POST, PUT, OPTIONS";
    case Resource::sources:
    case Resource::elevation: return "GET, HEAD, POST, OPTIONS";
    case Resource::dataset: return "GET, HEAD, PATCH, DELETE, OPTIONS";
    case Resource::source: return "GET, HEAD, PUT, DELETE, OPTIONS";
    case Resource::rollback:
    case Resource::uploads: return "POST, OPTIONS";
    case Resource::upload: return "GET, HEAD, PATCH, DELETE, OPTIONS";
    default: return "GET, HEAD, OPTIONS";
  }
}

}  // namespace cordillera::server
