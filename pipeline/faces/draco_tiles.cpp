#include "pipeline/faces/draco_tiles.h"

#include <array>

#include "pipeline/faces/walk.h"

namespace cordillera::pipeline::faces {
namespace {

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  return terrain.tile({place.z, place.x, place.y}, Encoding::drc);
}

std::optional<std::string> tag(const Terrain& terrain, const Place& place) {
  return terrain.tile_tag({place.z, place.x, place.y}, Encoding::drc);
}

constexpr std::array<Resource, 1> kResources = {{
    {"tiles/{z}/{x}/{y}.drc", Grid::geodetic, "application/octet-stream",
     "A tile as a Draco mesh of integers; the manifest's drc_formula makes degrees and metres of them", tile, Links::relative,
     Absent::not_found, Compression::none, tag},
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
