#include "server/routes.h"

#include <charconv>
#include <optional>
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

/// Digits only, no leading zeros: a tile has one address.
std::optional<std::int32_t> number(std::string_view text) {
  if (text.empty() || text.size() > 9 || (text.size() > 1 && text[0] == '0')) return std::nullopt;
  std::int32_t value = 0;
  for (const char c : text) {
    if (c < '0' || c > '9') return std::nullopt;
    value = value * 10 + (c - '0');
  }
  return value;
}

std::optional<proto::TileAddress> address(std::string_view level, std::string_view x, std::string_view y) {
  const auto z = number(level), column = number(x), row = number(y);
  if (!z || !column || !row || *z > 30) return std::nullopt;
  return proto::TileAddress{*z, *column, *row};
}

bool strip(std::string_view* text, std::string_view suffix) {
  if (text->size() <= suffix.size() || text->substr(text->size() - suffix.size()) != suffix) return false;
  text->remove_suffix(suffix.size());
  return true;
}

bool is_hemisphere(std::string_view text) { return text == "W" || text == "E"; }

/// parts: what follows …/tiles/.
Route tile_route(Route route, const std::vector<std::string_view>& parts) {
  std::string_view last = parts.back();
  const bool glb = strip(&last, ".glb");
  if (!glb && !strip(&last, ".drc")) return {};
  route.resource = Resource::tile;
  route.face = glb ? pipeline::Face::glb : pipeline::Face::drc;
  const bool relative = parts.size() == 4 && is_hemisphere(parts[0]);
  if (!relative && parts.size() != 3) return {};
  const auto place = relative ? address(parts[1], parts[2], last) : address(parts[0], parts[1], last);
  if (!place) return {};
  route.address = *place;
  if (!relative) return route;
  if (route.address.z > proto::kMaxLevel || route.address.x >= proto::tiles_up(route.address.z)) return {};
  if (parts[0] == "E") route.address.x += proto::tiles_up(route.address.z);
  return route;
}

Route subtree_route(Route route, const std::vector<std::string_view>& parts) {
  std::string_view last = parts.back();
  if (parts.size() != 4 || !is_hemisphere(parts[0]) || !strip(&last, ".subtree")) return {};
  const auto place = address(parts[1], parts[2], last);
  if (!place) return {};
  route.resource = Resource::subtree;
  route.hemisphere = parts[0][0];
  route.address = *place;
  return route;
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
  const std::vector<std::string_view> rest(parts.begin() + 4, parts.end());
  if (rest.empty()) {
    route.resource = Resource::dataset;
  } else if (rest.size() == 1) {
    route.resource = rest[0] == "events" ? Resource::events : rest[0] == "manifest.json" ? Resource::manifest
                     : rest[0] == "tileset.json" ? Resource::tileset : Resource::none;
  } else if (rest[0] == "tiles") {
    return tile_route(route, {rest.begin() + 1, rest.end()});
  } else if (rest[0] == "subtrees") {
    return subtree_route(route, {rest.begin() + 1, rest.end()});
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
