#include "pipeline/exports/tile_places.h"

#include <stdexcept>

#include "pipeline/tileset/implicit_tile.h"

namespace cordillera::pipeline::exports {
namespace {

using faces::Grid;
using faces::Place;
using faces::Resource;

std::string_view ending(std::string_view path) { return path.substr(path.rfind('.') + 1); }

}  // namespace

const Resource* tiles_of(const faces::Face& face) {
  for (const Resource& resource : face.resources) {
    const bool document = resource.type == "application/json";  // of a tileset in parts, which name each other by their paths
    if (!document && resource.grid != Grid::none && resource.grid != Grid::implicit) return &resource;
  }
  return nullptr;
}

void each_named(const faces::Terrain& terrain, const faces::Face& face, faces::Listing listing,
                const std::function<void(const std::string& path, const faces::Found& found)>& visit) {
  const auto take = [&](const std::string& path) {
    const auto found = faces::find(path);
    if (!found) throw std::logic_error("a face names " + path + ", which it does not know");
    visit(path, *found);
  };
  face.each_path(terrain, {take, listing});
}

void each_place(const faces::Terrain& terrain, const faces::Face& face, const Resource& tiles, faces::Listing listing,
                const std::function<void(const Place&)>& visit) {
  each_named(terrain, face, listing, [&](const std::string&, const faces::Found& found) {
    const Place& at = found.place;
    if (found.resource->path == tiles.path) visit(at);
    const bool below_a_root = found.resource->grid == Grid::implicit && tiles.grid == Grid::geodetic;
    if (!below_a_root || ending(found.resource->path) != ending(tiles.path)) return;
    if (const auto tile = absolute_tile(at.root, at.z, at.x, at.y)) visit({0, tile->z, tile->x, tile->y});
  });
}

SquareAddress square_address(Grid grid, const Place& place) {
  const auto x = static_cast<std::uint32_t>(place.x);
  if (grid == Grid::web_mercator) return {place.z, x, static_cast<std::uint32_t>(place.y)};
  if (grid == Grid::web_mercator_south) return {place.z, x, static_cast<std::uint32_t>(proto::tiles_up(place.z) - 1 - place.y)};
  return {place.z + 1, x, static_cast<std::uint32_t>(proto::tiles_up(place.z) - 1 - place.y)};
}

Place place_at(Grid grid, const SquareAddress& address) {
  const auto x = static_cast<std::int32_t>(address.x), y = static_cast<std::int32_t>(address.y);
  if (grid == Grid::web_mercator) return {0, address.zoom, x, y};
  if (grid == Grid::web_mercator_south) return {0, address.zoom, x, proto::tiles_up(address.zoom) - 1 - y};
  return {0, address.zoom - 1, x, proto::tiles_up(address.zoom - 1) - 1 - y};
}

const char* square_matrix_set(Grid grid) { return is_mercator(grid) ? "WebMercatorQuad" : "GoogleCRS84Quad"; }

}  // namespace cordillera::pipeline::exports
