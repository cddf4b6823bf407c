#include "server/routes.h"

#include <vector>

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

bool is_id(std::string_view text) {
  if (text.empty() || text.size() > 80) return false;
  for (const char c : text) {
    if (!(c >= 'a' && c <= 'z') && !(c >= '0' && c <= '9') && c != '-') return false;
  }
  return true;
}

}  // namespace

Route parse_route(std::string_view path) {
  Route route;
  const auto parts = split(path);
  if (path == "/healthz") route.resource = Resource::health;
  if (path == "/readyz") route.resource = Resource::readiness;
  if (path == "/v1") route.resource = Resource::index;
  if (path == "/v1/datasets") route.resource = Resource::datasets;
  if (route.resource != Resource::none) return route;
  if (path.empty() || path[0] != '/') return {};
  if (parts.size() < 2 || parts[1] != "v1") {
    route.resource = Resource::page;
    return route;
  }
  if (parts.size() < 4 || parts[2] != "datasets" || !is_id(parts[3])) return {};
  route.id = std::string(parts[3]);
  if (parts.size() == 4) {
    route.resource = Resource::dataset;
    return route;
  }
  route.path = path.substr(static_cast<std::size_t>(parts[4].data() - path.data()));
  if (route.path == "events") {
    route.resource = Resource::events;
  } else if (route.path == "manifest.json") {
    route.resource = Resource::manifest;
  } else if (const auto found = pipeline::faces::find(route.path)) {
    route.resource = Resource::face;
    route.found = *found;
  }
  return route;
}

std::string allowed_methods(Resource resource) {
  switch (resource) {
    case Resource::datasets: return "GET, HEAD, POST, OPTIONS";
    case Resource::dataset: return "GET, HEAD, DELETE, OPTIONS";
    default: return "GET, HEAD, OPTIONS";
  }
}

}  // namespace cordillera::server
