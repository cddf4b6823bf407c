#include "pipeline/faces/draco_tiles.h"

#include <array>

#include "pipeline/faces/walk.h"

namespace cordillera::pipeline::faces {
namespace {

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  auto blob = terrain.store().tile({place.z, place.x, place.y}, Encoding::drc);
  if (!blob) return std::optional<Document>();
  return std::optional(Document{std::move(blob->bytes), std::move(blob->etag)});
}

constexpr std::array<Resource, 1> kResources = {{
    {"tiles/{z}/{x}/{y}.drc", Grid::geodetic, "application/octet-stream",
     "A tile as a Draco mesh of integers; the manifest's drc_formula makes degrees and metres of them", tile},
}};

void each_path(const Terrain& terrain, const PathSink& sink) {
  walk_tiles(terrain.store(), [&](const TileExtent& node) {
    if (node.content) sink(path_of(kResources[0], {0, node.tile.z, node.tile.x, node.tile.y}));
  });
}

}  // namespace

const Face& draco_tiles() {
  static const Face kFace = {"drc", "any program with Draco: exact lattice coordinates", "manifest.json", kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
