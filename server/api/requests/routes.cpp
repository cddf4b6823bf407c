#include "server/api/requests/routes.h"

#include <algorithm>

#include "pipeline/exports/mesh/mesh_output.h"
#include "pipeline/faces/path_pattern.h"

namespace cordillera::server {
namespace {

using access::Role;
using pipeline::faces::matches;

constexpr std::string_view kDatasets = "/v1/datasets/", kVersionsBelow = "/versions/", kManifestBelow = "/manifest.json",
                           kLivePath = "/v1/live";

bool is_of_one(const RouteRow& row) { return row.path.starts_with(kOneDataset); }

/// Whether the value may stand for the brace. What a request needs of it goes into the route.
bool take_brace(std::string_view name, std::string_view value, Route& route) {
  if (name == "mesh_format") return pipeline::exports::mesh_kind(value).has_value();
  if (name == "resource") {
    const auto found = pipeline::faces::find(value);
    if (found) route.found = *found;
    return found.has_value();
  }
  if (is_id(value)) (name == "id" ? route.id : route.item) = value;
  return is_id(value);
}

/// below: what stands behind the dataset's id, its version or /v1/live. is: what the row has to be.
bool find_below(std::string_view below, RouteRow::Is is, Route& route) {
  for (const RouteRow& row : route_table()) {
    if (!is_of_one(row) || (row.is & is) != is) continue;
    const std::string_view pattern = row.path.substr(kOneDataset.size());
    if (!matches(pattern, below, [&](auto name, auto value) { return take_brace(name, value, route); })) continue;
    route.row = &row;
    return true;
  }
  return false;
}

/// rest: behind /v1/datasets/.
Route route_of_one(std::string_view rest) {
  const std::string_view id = rest.substr(0, rest.find_first_of("/."));
  if (!is_id(id)) return {};
  Route route;
  route.id = id;
  std::string_view below = rest.substr(id.size());
  // What a version names stays as it is for ever, so only what a finished build has goes below one.
  RouteRow::Is is = RouteRow::kPlain;
  if (below.starts_with(kVersionsBelow)) {
    const std::string_view behind = below.substr(kVersionsBelow.size());
    const std::string_view version = behind.substr(0, behind.find('/'));
    if (is_id(version)) {
      route.version = version;
      below = behind.substr(version.size());
      if (below.empty() || below == "/") below = kManifestBelow;  // links.version itself, which other paths are below
      is = RouteRow::kVersioned;
    }
  }
  const bool deeper = below.starts_with('/');
  if (!find_below(below, is, route) && !deeper) return {};
  if (deeper) route.path = below.substr(1);
  return route;
}

const RouteRow* row_where(const std::function<bool(const RouteRow&)>& fits) {
  const auto found = std::find_if(route_table().begin(), route_table().end(), fits);
  return found == route_table().end() ? nullptr : &*found;
}

/// below: behind /v1/live. The row is that of /v1/live, whatever it leads to.
Route route_of_address(std::string_view below) {
  Route found, route;
  if (!find_below(below, RouteRow::kLive, found)) return {};
  route.row = row_where([](const RouteRow& row) { return row.path == kLivePath; });
  route.path = below.substr(below.starts_with('/') ? 1 : 0);
  return route;
}

}  // namespace

const RouteMethod* RouteRow::method(std::string_view asked) const {
  if (asked == "HEAD") asked = "GET";
  const auto found = std::find_if(methods.begin(), methods.end(), [&](const RouteMethod& one) { return one.name == asked; });
  return found == methods.end() ? nullptr : &*found;
}

Route parse_route(std::string_view path) {
  if (!path.starts_with('/')) return {};
  if (path == "/stac/" || path == "/v1/live/") path.remove_suffix(1);  // what links resolve against: as good as the other
  if (path.starts_with(kDatasets)) return route_of_one(path.substr(kDatasets.size()));
  if (path.starts_with(kLivePath) && path != kLivePath) return route_of_address(path.substr(kLivePath.size()));
  Route route;
  route.row = row_where([&](const RouteRow& row) {
    return !is_of_one(row) && matches(row.path, path, [&](auto name, auto value) { return take_brace(name, value, route); });
  });
  const bool of_api = path.starts_with("/v1/") || path.starts_with("/stac/");
  if (route.row == nullptr && !of_api)
    route.row = row_where([](const RouteRow& row) { return (row.is & RouteRow::kElsewhere) != 0; });
  return route;
}

std::string route_name(const Route& route) {
  if (route.row == nullptr) return "unknown";
  if (route.found.resource == nullptr) return std::string(route.row->name);
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    for (const auto& resource : face->resources) {
      if (&resource == route.found.resource) return std::string(face->name);
    }
  }
  return "face";
}

std::string allowed_methods(const Route& route) {
  if (route.row == nullptr) return "GET, HEAD, OPTIONS";
  std::string names;
  for (const RouteMethod& method : route.row->methods) names.append(method.name).append(method.name == "GET" ? ", HEAD, " : ", ");
  return names + "OPTIONS";
}

Role role_needed(const std::string& method, const Route& route) {
  if (method == "OPTIONS") return Role::none;  // a browser that asks whether it may shows no token
  const bool reads = method == "GET" || method == "HEAD";
  const auto answering = [&](std::string_view name) { return route.row == nullptr ? nullptr : route.row->method(name); };
  const RouteMethod* found = answering(reads ? "GET" : std::string_view(method));
  if (found == nullptr && !reads) found = answering("POST");
  return found != nullptr ? found->needs : reads ? Role::none : Role::write;
}

bool only_reads(const std::string& method, const Route& route) { return role_needed(method, route) < Role::write; }

}  // namespace cordillera::server
