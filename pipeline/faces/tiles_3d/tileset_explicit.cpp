#include "pipeline/faces/tiles_3d/tileset_explicit.h"

#include <algorithm>
#include <array>

#include "pipeline/encode/json.h"
#include "pipeline/faces/tiles_3d/glb_tile.h"
#include "pipeline/faces/walk.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/tileset.h"

namespace cordillera::pipeline::faces {
namespace {

// A file holds up to 85 tiles and names up to 256 files below it: some 40 kB, and four requests down to level 15.
constexpr int kLevels = 4;

std::string glb_path(const proto::TileAddress& tile) {
  return std::string("tiles/") + hemisphere_of(tile) + "/" + std::to_string(tile.z) + "/" + std::to_string(implicit_x(tile)) +
         "/" + std::to_string(tile.y) + ".glb";
}

std::string file_path(const proto::TileAddress& tile) {
  return "explicit/" + std::to_string(tile.z) + "/" + std::to_string(tile.x) + "/" + std::to_string(tile.y) + ".json";
}

class Writer {
 public:
  /// up: from the file's own folder to the dataset's. query: of every link.
  Writer(const StoreReader& store, std::string up, std::string_view query)
      : store_(store), errors_(store.manifest()), up_(std::move(up)), query_(query) {}

  /// The first tile of a file, and what is below it.
  Json first(const TileExtent& node) const {
    return tile(node, kLevels, errors_.stands_for_data(node) ? errors_.of(node) : error_above_m(node.tile));
  }
  /// A tile and what is below it, down to the next files. above_m: geometric error of the tile above, which is never less than
  /// that of one that does not stand for the data.
  Json tile(const TileExtent& node, int levels_left, double above_m) const {
    const double error_m = errors_.stands_for_data(node) ? errors_.of(node) : std::min(errors_.empty_m(), above_m);
    Json out = {{"boundingVolume", {{"region", node.region}}}, {"geometricError", error_m}};
    if (levels_left == 0) {
      out["content"] = {{"uri", link(file_path(node.tile))}};
      return out;
    }
    if (node.content) out["content"] = {{"uri", link(glb_path(node.tile))}};
    const auto& [z, x, y] = node.tile;
    Json children = Json::array();
    if (z < static_cast<int>(store_.manifest().max_level())) {
      for (const TileExtent& child : store_.extents(z + 1, 2 * x, 2 * y, 2 * x + 1, 2 * y + 1)) {
        children.push_back(tile(child, levels_left - 1, error_m));
      }
    }
    if (!children.empty()) out["children"] = std::move(children);
    return out;
  }

  std::string file(Json root) const {
    root["refine"] = "REPLACE";
    Json out;
    out["asset"] = tileset_asset(store_.manifest());
    out["geometricError"] = root["geometricError"];
    out["root"] = std::move(root);
    return out.dump(-1, ' ', false, Json::error_handler_t::replace);
  }

 private:
  /// The least that a tile above this one states.
  double error_above_m(proto::TileAddress tile) const {
    while (tile.z > 0) {
      tile = tile.parent();
      const auto above = store_.extents(tile.z, tile.x, tile.y, tile.x, tile.y);
      if (!above.empty() && errors_.stands_for_data(above[0])) return errors_.of(above[0]);
    }
    return errors_.empty_m();
  }
  std::string link(const std::string& path) const { return (up_ + path).append(query_); }

  const StoreReader& store_;
  const RefineErrors errors_;
  std::string up_;
  std::string_view query_;
};

proto::Result<std::optional<Document>> top(const Terrain& terrain, const Place& place) {
  const auto query = normals_query(place.normals);
  if (!query) return query.problem();
  const StoreReader& store = terrain.store();
  const Writer writer(store, "", *query);
  Json root, children = Json::array();
  const std::vector<TileExtent> roots = store.extents(0, 0, 0, 1, 0);
  for (const TileExtent& node : roots) children.push_back(writer.tile(node, 0, empty_error_m(terrain.manifest())));
  root["boundingVolume"] = root_volume(roots, terrain.manifest());
  root["geometricError"] = empty_error_m(terrain.manifest());
  if (!children.empty()) root["children"] = std::move(children);
  return std::optional(document(writer.file(std::move(root))));
}

proto::Result<std::optional<Document>> part(const Terrain& terrain, const Place& place) {
  const auto query = normals_query(place.normals);
  if (!query) return query.problem();
  if (place.z % kLevels != 0) return std::optional<Document>();
  const auto nodes = terrain.store().extents(place.z, place.x, place.y, place.x, place.y);
  if (nodes.empty()) return std::optional<Document>();
  const Writer writer(terrain.store(), "../../../", *query);
  return std::optional(document(writer.file(writer.first(nodes[0]))));
}

constexpr std::array<Resource, 2> kResources = {{
    {.path = "tileset-explicit.json",
     .type = "application/json",
     .about = "3D Tiles tileset without implicit tiling",
     .make = top,
     .normals = kNormals},
    {.path = "explicit/{z}/{x}/{y}.json",
     .grid = Grid::geodetic,
     .type = "application/json",
     .about = "Four levels of that tileset",
     .make = part,
     .normals = kNormals},
}};

void each_path(const Terrain& terrain, const PathSink& sink) {
  walk_tiles(terrain.store(), [&](const TileExtent& node) {
    if (node.content) sink(glb_path(node.tile));
    if (node.tile.z % kLevels == 0) sink(file_path(node.tile));
  });
  sink("tileset-explicit.json");
}

}  // namespace

const Face& tileset_explicit() {
  static const Face kFace = {"3d-tiles-explicit", "3D Tiles clients without implicit tiling", "tileset-explicit.json", kResources,
                             each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
