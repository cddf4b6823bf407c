#include "pipeline/faces/face.h"

#include <algorithm>

#include "pipeline/faces/path_pattern.h"
#include "proto/numbers.h"

namespace cordillera::pipeline::faces {
namespace {

/// Digits only, no sign, no leading zeros.
std::optional<std::int32_t> number(std::string_view text) {
  if (text.starts_with('-') || (text.starts_with('0') && text.size() > 1)) return std::nullopt;
  return proto::number<std::int32_t>(text);
}

std::optional<Place> match(const Resource& resource, std::string_view path) {
  Place place;
  const bool found = matches(resource.path, path, [&place](std::string_view name, std::string_view value) {
    if (name == "root") {
      if (value != "W" && value != "E") return false;
      place.root = value[0];
      return true;
    }
    const auto counted = number(value);
    if (counted) (name == "z" ? place.z : name == "x" ? place.x : place.y) = *counted;
    return counted.has_value();
  });
  return found ? std::optional(place) : std::nullopt;
}

}  // namespace

bool is_of_maps(const Face& face) {
  return std::ranges::all_of(face.resources,
                             [](const Resource& resource) { return resource.grid == Grid::none || is_mercator(resource.grid); });
}

bool inside(Grid grid, const Place& p) {
  if (grid == Grid::none) return true;
  if (p.z > proto::kMaxLevel) return false;
  const std::int32_t up = proto::tiles_up(p.z);  // of a square grid, across too
  return p.x < (grid == Grid::geodetic ? proto::tiles_across(p.z) : up) && p.y < up;
}

const Face* face_named(std::string_view name) {
  for (const Face* face : all_faces()) {
    if (face->name == name) return face;
  }
  return nullptr;
}

std::optional<Found> find(std::string_view path) {
  for (const Face* face : all_faces()) {
    for (const Resource& resource : face->resources) {
      if (const auto place = match(resource, path)) return Found{&resource, *place};
    }
  }
  return std::nullopt;
}

std::string path_of(const Resource& resource, const Place& place) {
  std::string out;
  std::string_view pattern = resource.path;
  for (std::size_t brace; (brace = pattern.find('{')) != pattern.npos;) {
    out += pattern.substr(0, brace);
    const std::size_t end = pattern.find('}', brace);
    const std::string_view name = pattern.substr(brace + 1, end - brace - 1);
    if (name == "root")
      out += place.root;
    else
      out += std::to_string(name == "z" ? place.z : name == "x" ? place.x : place.y);
    pattern.remove_prefix(end + 1);
  }
  return out.append(pattern);
}

}  // namespace cordillera::pipeline::faces
