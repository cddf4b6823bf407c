#include "pipeline/faces/quantized_mesh/terrain_tileset.h"

#include <algorithm>
#include <array>
#include <numbers>

#include "pipeline/encode/json.h"
#include "pipeline/faces/quantized_mesh/layer_json.h"
#include "pipeline/faces/quantized_mesh/terrain_tileset_glb.h"
#include "pipeline/faces/quantized_mesh/terrain_tileset_subtree.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/tileset.h"
#include "proto/mesh.h"

namespace cordillera::pipeline::faces {
namespace {

// What CesiumJS expects of a grid of 65 x 65 heights at level 0; it halves from level to level, as the provider does itself.
constexpr double kLevelZeroError_m = 77067.34;

Json property(const char* semantic, const char* type, int count) {
  Json out = {{"semantic", semantic}, {"type", type}, {"componentType", "FLOAT64"}, {"required", true}};
  if (count > 0) {
    out["array"] = true;
    out["count"] = count;
  }
  return out;
}

Json schema() {
  const Json properties = {{"minimum_height", property("TILE_MINIMUM_HEIGHT", "SCALAR", 0)},
                           {"maximum_height", property("TILE_MAXIMUM_HEIGHT", "SCALAR", 0)},
                           {"bounding_sphere", property("TILE_BOUNDING_SPHERE", "SCALAR", 4)},
                           {"horizon_occlusion_point", property("TILE_HORIZON_OCCLUSION_POINT", "VEC3", 0)}};
  return {{"id", "cordillera_terrain"}, {"classes", {{"tile", {{"properties", properties}}}}}};
}

/// The finest level that has something of the dataset at or below a tile. Where data is there are seldom fewer levels than
/// elsewhere, so the first way down mostly tells.
int finest_below(const GeodeticGrid& grid, const proto::TileAddress& tile) {
  int finest = tile.z;
  if (finest == grid.finest()) return finest;
  const int z = tile.z + 1;
  for (const TileExtent& node : grid.terrain().store().extents(z, 2 * tile.x, 2 * tile.y, 2 * tile.x + 1, 2 * tile.y + 1)) {
    finest = std::max(finest, finest_below(grid, node.tile));
    if (finest == grid.finest()) break;
  }
  return finest;
}

Json root_of(const Terrain& terrain, char hemisphere) {
  const std::string side(1, hemisphere);
  Json out;
  out["boundingVolume"] = {{"region", hemisphere_region(hemisphere, -proto::kMaxHeight_m, proto::kMaxHeight_m)}};
  out["geometricError"] = kLevelZeroError_m;
  out["refine"] = "REPLACE";
  out["content"] = {{"uri", side + "/{level}/{x}/{y}.glb"}};
  out["implicitTiling"] = {{"subdivisionScheme", "QUADTREE"},
                           {"subtreeLevels", kTerrainSubtreeLevels},
                           {"availableLevels", finest_below(GeodeticGrid(terrain), *absolute_tile(hemisphere, 0, 0, 0)) + 1},
                           {"subtrees", {{"uri", "subtrees/" + side + "/{level}/{x}/{y}.subtree"}}}};
  return out;
}

std::string tileset_json(const Terrain& terrain) {
  const proto::Manifest& manifest = terrain.manifest();
  Json root;
  root["boundingVolume"] = {{"region", Json::array({-std::numbers::pi, -std::numbers::pi / 2, std::numbers::pi,
                                                    std::numbers::pi / 2, -proto::kMaxHeight_m, proto::kMaxHeight_m})}};
  root["geometricError"] = 2 * kLevelZeroError_m;
  root["refine"] = "REPLACE";
  root["children"] = Json::array({root_of(terrain, 'W'), root_of(terrain, 'E')});
  Json out;
  out["asset"] = tileset_asset(manifest);
  out["schema"] = schema();
  out["geometricError"] = 2 * kLevelZeroError_m;
  out["root"] = std::move(root);
  return out.dump(1, ' ', false, Json::error_handler_t::replace);
}

proto::Result<std::optional<Document>> tileset(const Terrain& terrain, const Place&) {
  return terrain.kept("terrain3d/tileset.json",
                      [&]() -> proto::Result<std::optional<Document>> { return std::optional(document(tileset_json(terrain))); });
}

std::optional<proto::TileAddress> at(const Terrain& terrain, const Place& place) {
  const auto tile = absolute_tile(place.root, place.z, place.x, place.y);
  return tile && has_quantized_tile(GeodeticGrid(terrain), *tile) ? tile : std::nullopt;
}

proto::Result<std::optional<Document>> subtree_of(const Terrain& terrain, const Place& place);
proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place);

constexpr std::array<Resource, 3> kResources = {{
    {"terrain3d/tileset.json", Grid::none, "application/json",
     "3D Tiles tileset of the terrain surface, for Cesium3DTilesTerrainProvider", tileset},
    {"terrain3d/subtrees/{root}/{z}/{x}/{y}.subtree", Grid::implicit, "application/octet-stream",
     "Availability, heights, spheres and horizon points of a part of that tileset", subtree_of},
    {"terrain3d/{root}/{z}/{x}/{y}.glb", Grid::implicit, "model/gltf-binary", "A tile of it, as binary glTF without compression",
     tile, Links::relative, Absent::not_found, Compression::gzip},
}};

proto::Result<std::optional<Document>> subtree_of(const Terrain& terrain, const Place& place) {
  return terrain.kept(path_of(kResources[1], place), [&]() -> proto::Result<std::optional<Document>> {
    const auto found = at(terrain, place);
    auto bytes = found ? terrain_subtree(terrain, *found) : std::nullopt;
    if (!bytes) return std::optional<Document>();
    return std::optional(document(std::move(*bytes)));
  });
}

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  return terrain.kept(path_of(kResources[2], place), [&]() -> proto::Result<std::optional<Document>> {
    const auto found = at(terrain, place);
    if (!found) return std::optional<Document>();
    return std::optional(
        document(terrain_glb(quantized_surface(GeodeticGrid(terrain), *found), terrain.manifest().attribution())));
  });
}

void each_path(const Terrain& terrain, const PathSink& sink) {
  each_quantized_tile(GeodeticGrid(terrain), [&](const proto::TileAddress& tile) {
    const Place place{hemisphere_of(tile), tile.z, implicit_x(tile), tile.y};
    sink(path_of(kResources[2], place));
    if (tile.z % kTerrainSubtreeLevels == 0) sink(path_of(kResources[1], place));
  });
  sink("terrain3d/tileset.json");
}

}  // namespace

const Face& terrain_tileset() {
  static const Face kFace = {"terrain-3d", "CesiumJS' Cesium3DTilesTerrainProvider (experimental)", "terrain3d/tileset.json",
                             kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
