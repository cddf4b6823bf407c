#include "pipeline/faces/mercator/mercator_terrain.h"

#include <array>

#include "pipeline/faces/mercator/mercator_grid.h"
#include "pipeline/faces/quantized_mesh/layer_json.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bytes.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::string_view kLayer = "web-mercator/layer.json", kTiles = "web-mercator/terrain/{z}/{x}/{y}.terrain";

proto::Result<std::optional<Document>> layer(const Terrain& terrain, const Place&) {
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
  return terrain.kept(path_of(kResources[1], place), [&]() -> proto::Result<std::optional<Document>> {
    const MercatorGrid grid(terrain);
    const proto::TileAddress at{place.z, place.x, place.y};
    if (!has_quantized_tile(grid, at)) return std::optional<Document>();
    return std::optional(document(quantized_mesh_tile(grid, at)));
  });
}

void each_path(const Terrain& terrain, const PathSink& sink) {
  const MercatorGrid grid(terrain);
  for (int z = 0; z <= grid.finest(); ++z) {
    for (const TileRange& range : quantized_ranges(grid, z)) {
      for (std::int32_t y = range.start_y; y <= range.end_y; ++y) {
        for (std::int32_t x = range.start_x; x <= range.end_x; ++x) sink(path_of(kResources[1], {0, z, x, y}));
      }
    }
  }
  sink(std::string(kLayer));
}

}  // namespace

const Face& mercator_terrain() {
  static const Face kFace = {"quantized-mesh-mercator", "the same terrain in EPSG:3857, for scenes on Web Mercator's tiles",
                             kLayer, kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
