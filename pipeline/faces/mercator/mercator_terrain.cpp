#include "pipeline/faces/mercator/mercator_terrain.h"

#include <array>

#include "pipeline/faces/mercator/mercator_grid.h"
#include "pipeline/faces/quantized_mesh/layer_json.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bytes.h"
#include "pipeline/faces/tilejson.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::string_view kLayer = "web-mercator/layer.json", kTiles = "web-mercator/terrain/{z}/{x}/{y}.terrain";

proto::Result<std::optional<Document>> layer(const Terrain& terrain, const Place&) {
  if (!extent_of(terrain.manifest())) return beyond_mercator();
  return terrain.kept(std::string(kLayer), [&]() -> proto::Result<std::optional<Document>> {
    return std::optional(document(layer_json(MercatorGrid(terrain), "EPSG:3857")));
  });
}

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place);

constexpr std::array<Resource, 2> kResources = {{
    {kLayer, Grid::none, "application/json", "Levels, available tiles and bounds of the quantized-mesh terrain in EPSG:3857",
     layer},
    {kTiles, Grid::web_mercator_south, "application/vnd.quantized-mesh", "A tile of quantized-mesh 1.0 in EPSG:3857", tile,
     Links::relative, Absent::not_found, Compression::gzip},
}};

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  return terrain.kept(path_of(kResources[1], place), [&] {
    return quantized_mesh_document(MercatorGrid(terrain), {place.z, place.x, place.y});
  });
}

void each_path(const Terrain& terrain, const PathSink& sink) {
  if (!extent_of(terrain.manifest())) return;
  each_quantized_tile(MercatorGrid(terrain), [&](const proto::TileAddress& at) {
    sink(path_of(kResources[1], {0, at.z, at.x, at.y}));
  });
  sink(std::string(kLayer));
}

}  // namespace

const Face& mercator_terrain() {
  static const Face kFace = {"quantized-mesh-mercator", "the same terrain in EPSG:3857, for scenes on Web Mercator's tiles",
                             kLayer, kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
