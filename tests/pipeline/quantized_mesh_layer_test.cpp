// What layer.json says of tiles: what QGIS reads of it, and that it lists those that there are where rows of the map are narrow.
#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>

#include "pipeline/encode/json.h"
#include "pipeline/faces/mercator/mercator_mesh.h"
#include "tests/pipeline/quantized_mesh_dataset.h"

namespace cordillera::pipeline {
namespace {

using proto::TileAddress;
using namespace testing;

/// The fields without which QGIS's provider (src/core/tiledscene/qgsquantizedmeshdataprovider.cpp, read at 0c85fff) opens no
/// layer, of the types that it takes.
TEST(QuantizedMesh, LayerHasWhatQgisReads) {
  for (const char* document : {"layer.json", "web-mercator/layer.json"}) {
    SCOPED_TRACE(document);
    const Json layer = Json::parse(fetch(document)->bytes);
    EXPECT_EQ(layer.at("format"), "quantized-mesh-1.0");
    EXPECT_TRUE(layer.at("projection") == "EPSG:4326" || layer.at("projection") == "EPSG:3857");
    EXPECT_TRUE(layer.at("scheme").is_string());
    EXPECT_TRUE(layer.at("version").is_string());
    EXPECT_EQ(layer.at("bounds").size(), 4u);
    EXPECT_TRUE(layer.at("minzoom").is_number_unsigned() && layer.at("maxzoom").is_number_unsigned());
    ASSERT_FALSE(layer.at("tiles").empty());
    for (const char* part : {"{z}", "{x}", "{y}"})
      EXPECT_NE(layer["tiles"][0].get<std::string>().find(part), std::string::npos) << part;
    for (const Json& level : layer.at("available"))
      for (const Json& range : level)
        for (const char* side : {"startX", "startY", "endX", "endY"}) EXPECT_TRUE(range.at(side).is_number_integer()) << side;
  }
}

constexpr int kFinestZoom = kFinest + 1;

std::string path_of(const TileAddress& t) {
  return "web-mercator/terrain/" + std::to_string(t.z) + "/" + std::to_string(t.x) + "/" + std::to_string(t.y) + ".terrain";
}

/// There a node of the dataset is ten rows of the map high, and its data may lie in a few of them.
TEST(QuantizedMesh, LayerOfWebMercatorListsWhatThereIsNearThePole) {
  const TileAddress node{kFinest, 130, 123};
  const std::int64_t from = kLattice.south(node) + kLattice.tile_units(kFinest) / 2;
  const SomeTiles polar(node, node, [from](std::int64_t, std::int64_t row) {
    return row < from ? std::optional<double>() : std::optional<double>(500);
  });
  const Json layer = Json::parse(polar.fetch("web-mercator/layer.json")->bytes);
  const std::set<TileAddress> listed = listed_in(layer);
  std::set<TileAddress> with_data;
  for (int z = 0; z <= kFinestZoom; ++z) {
    const std::int32_t column = node.x >> (kFinestZoom - z);
    for (std::int32_t y = 0; y < 1 << z; ++y) {
      const TileAddress at{z, column, y};
      EXPECT_EQ(polar.fetch(path_of(at)).has_value(), listed.contains(at)) << path_of(at);
    }
  }
  for (const TileAddress& at : listed) {
    const bool has_data = !faces::mercator_mesh(*polar.terrain, at, faces::MercatorNormals::none).triangles.empty();
    if (at.z == kFinestZoom && has_data) with_data.insert(at.parent());
  }
  EXPECT_FALSE(with_data.empty());
  for (const TileAddress& at : listed) {
    if (at.z == kFinestZoom) { EXPECT_TRUE(with_data.contains(at.parent())) << path_of(at) << " shows nothing"; }
  }
}

}  // namespace
}  // namespace cordillera::pipeline
