#include "pipeline/faces/tiles_3d/tileset_3d.h"

#include <array>

#include "pipeline/faces/tiles_3d/glb_tile.h"
#include "pipeline/faces/walk.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/subtree.h"
#include "pipeline/tileset/tileset.h"
#include "raster/photo/orthophoto.h"

namespace cordillera::pipeline::faces {
namespace {

proto::Result<std::optional<Document>> tileset(const Terrain& terrain, const Place& place) {
  const auto query = normals_query(place.normals);
  if (!query) return query.problem();
  const auto& photo = terrain.look().photo;
  return std::optional(document(tileset_json(terrain.store(), *query, photo ? photo->name() : std::string())));
}

proto::Result<std::optional<Document>> subtree_of(const Terrain& terrain, const Place& place) {
  auto bytes = subtree(terrain.store(), place.root, place.z, place.x, place.y);
  if (!bytes) return std::optional<Document>();
  return std::optional(document(std::move(*bytes)));
}

std::optional<proto::TileAddress> address(const Place& place) {
  if (place.root == 0) return proto::TileAddress{place.z, place.x, place.y};
  return absolute_tile(place.root, place.z, place.x, place.y);
}

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  const auto at = address(place);
  if (!at) return std::optional<Document>();
  return glb_tile(terrain, *at, place.normals);
}

std::optional<std::string> tag(const Terrain& terrain, const Place& place) {
  const auto at = address(place);
  return at ? glb_tag(terrain, *at, place.normals) : std::nullopt;
}

constexpr std::array<Resource, 4> kResources = {{
    {.path = "tileset.json",
     .type = "application/json",
     .about = "3D Tiles 1.1 tileset with two implicit roots",
     .make = tileset,
     .normals = kNormals},
    {"subtrees/{root}/{z}/{x}/{y}.subtree", Grid::implicit, "application/octet-stream",
     "Availability, regions and errors of a part of an implicit tree", subtree_of},
    {.path = "tiles/{root}/{z}/{x}/{y}.glb",
     .grid = Grid::implicit,
     .type = "model/gltf-binary",
     .about = "A tile as binary glTF with Draco, by its address below a root",
     .make = tile,
     .tag = tag,
     .normals = kNormals},
    {.path = "tiles/{z}/{x}/{y}.glb",
     .grid = Grid::geodetic,
     .type = "model/gltf-binary",
     .about = "The same tile by its absolute address",
     .make = tile,
     .tag = tag,
     .normals = kNormals},
}};

void each_path(const Terrain& terrain, const PathSink& sink) {
  walk_tiles(terrain.store(), [&](const TileExtent& node) {
    const Place place{hemisphere_of(node.tile), node.tile.z, implicit_x(node.tile), node.tile.y};
    if (node.content) sink(path_of(kResources[2], place));
    if (node.tile.z % kSubtreeLevels == 0) sink(path_of(kResources[1], place));
  });
  sink("tileset.json");
}

}  // namespace

const Face& tileset_3d() {
  static const Face kFace = {"3d-tiles", "CesiumJS, Cesium for game engines, three.js, deck.gl", "tileset.json", kResources,
                             each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
