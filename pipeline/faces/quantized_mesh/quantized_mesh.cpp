#include "pipeline/faces/quantized_mesh/quantized_mesh.h"

#include <array>

#include "pipeline/faces/quantized_mesh/layer_json.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bytes.h"

namespace cordillera::pipeline::faces {
namespace {

proto::Result<std::optional<Document>> layer(const Terrain& terrain, const Place&) {
  return terrain.kept("layer.json", [&]() -> proto::Result<std::optional<Document>> {
    return std::optional(document(layer_json(GeodeticGrid(terrain), "EPSG:4326")));
  });
}

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place);

constexpr std::array<Resource, 2> kResources = {{
    {"layer.json", Grid::none, "application/json", "Levels, available tiles and bounds of the quantized-mesh terrain", layer},
    {"terrain/{z}/{x}/{y}.terrain", Grid::geodetic, "application/vnd.quantized-mesh",
     "A tile of quantized-mesh 1.0; beside the data and in holes it is at sea level", tile, Links::relative, Absent::not_found,
     Compression::gzip},
}};

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  return terrain.kept(path_of(kResources[1], place), [&] {
    return quantized_mesh_document(GeodeticGrid(terrain), {place.z, place.x, place.y});
  });
}

void each_path(const Terrain& terrain, const PathSink& sink) {
  each_quantized_tile(GeodeticGrid(terrain), [&](const proto::TileAddress& at) {
    sink(path_of(kResources[1], {0, at.z, at.x, at.y}));
  });
  sink("layer.json");
}

}  // namespace

const Face& quantized_mesh() {
  static const Face kFace = {"quantized-mesh", "CesiumJS' CesiumTerrainProvider, Cesium for game engines", "layer.json",
                             kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
