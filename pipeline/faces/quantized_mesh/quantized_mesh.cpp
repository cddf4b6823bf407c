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
  return terrain.kept(path_of(kResources[1], place), [&]() -> proto::Result<std::optional<Document>> {
    const GeodeticGrid grid(terrain);
    const proto::TileAddress at{place.z, place.x, place.y};
    if (!has_quantized_tile(grid, at)) return std::optional<Document>();
    return std::optional(document(quantized_mesh_tile(grid, at)));
  });
}

void each_path(const Terrain& terrain, const PathSink& sink) {
  const GeodeticGrid grid(terrain);
  for (int z = 0; z <= grid.finest(); ++z) {
    for (const TileRange& range : quantized_ranges(grid, z)) {
      for (std::int32_t y = range.start_y; y <= range.end_y; ++y) {
        for (std::int32_t x = range.start_x; x <= range.end_x; ++x) sink(path_of(kResources[1], {0, z, x, y}));
      }
    }
  }
  sink("layer.json");
}

}  // namespace

const Face& quantized_mesh() {
  static const Face kFace = {"quantized-mesh", "CesiumJS' CesiumTerrainProvider, Cesium for game engines", "layer.json",
                             kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
