#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <set>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/little_endian.h"
#include "tests/pipeline/quantized_mesh_dataset.h"

namespace cordillera::pipeline {
namespace {

using proto::Vec3;
using namespace testing;

std::string resolved(const std::string& from, const std::string& link) {
  return (std::filesystem::path(from).parent_path() / link).lexically_normal().string();
}

/// Follows a tile of the explicit tileset down; gathers what .glb it names.
void follow(const faces::Terrain& of, const std::string& file, const Json& tile, const Json* parent,
            std::multiset<std::string>& glbs) {
  const Json& region = tile["boundingVolume"]["region"];
  if (parent != nullptr) {
    const Json& around = (*parent)["boundingVolume"]["region"];
    EXPECT_LE(tile["geometricError"].get<double>(), (*parent)["geometricError"].get<double>()) << file;
    for (const std::size_t k : {0U, 1U, 4U}) EXPECT_GE(region[k].get<double>(), around[k].get<double>()) << file;
    for (const std::size_t k : {2U, 3U, 5U}) EXPECT_LE(region[k].get<double>(), around[k].get<double>()) << file;
  }
  if (tile.contains("content")) {
    const std::string path = resolved(file, tile["content"]["uri"]);
    const auto document = fetch(of, path);
    ASSERT_TRUE(document) << path;
    if (path.ends_with(".json")) {
      EXPECT_FALSE(tile.contains("children"));
      follow(of, path, Json::parse(document->bytes)["root"], &tile, glbs);
    } else {
      const auto glb = decode_glb(document->bytes);
      ASSERT_TRUE(glb.ok());
      EXPECT_FALSE(glb->triangles.empty());
      glbs.insert(path);
    }
  }
  if (!tile.contains("children")) return;
  for (const Json& child : tile["children"]) follow(of, file, child, &tile, glbs);
}

TEST(ExplicitTileset, NamesEveryTileOnce) {
  const Json top = Json::parse(fetch("tileset-explicit.json")->bytes);
  EXPECT_EQ(top["asset"]["copyright"], "Nobody <nobody@example.org>");
  EXPECT_EQ(top["root"]["refine"], "REPLACE");
  std::multiset<std::string> glbs;
  follow(terrain(), "tileset-explicit.json", top["root"], nullptr, glbs);
  std::size_t tiles = 0;
  for (int z = 0; z <= kFinest; ++z) {
    tiles += terrain().store().records(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1).size();
  }
  EXPECT_GT(tiles, 40U);
  EXPECT_EQ(glbs.size(), tiles);
  EXPECT_EQ(std::set<std::string>(glbs.begin(), glbs.end()).size(), tiles);
  EXPECT_FALSE(fetch("explicit/1/1/1.json")) << "no file begins there";
}

// Level 4 has lost its content in the west, below tiles that have theirs.
TEST(ExplicitTileset, ErrorsFallBelowTilesWithoutContent) {
  const TemporaryFolder folder;
  auto writer = StoreWriter::open(folder / "a.db", synthetic_plan(kFinest));
  ASSERT_TRUE(writer.ok());
  for (FinishedTask& task : synthetic_tasks(kLattice, {kFinest, 126, 80}, {kFinest, 131, 85}, hills_with_voids())) {
    if (task.node.z == 4 && task.node.x == 15) task.tiles.clear();
    ASSERT_TRUE((*writer)->commit(task).ok());
  }
  ASSERT_TRUE((*writer)->publish(synthetic_manifest()).ok());
  const faces::Terrain of(std::shared_ptr<const StoreReader>(StoreReader::open(folder / "a.db").value()));
  EXPECT_TRUE(of.store().extents(3, 7, 5, 7, 5).at(0).content);
  EXPECT_FALSE(of.store().extents(4, 15, 10, 15, 10).at(0).content);
  std::multiset<std::string> glbs;
  follow(of, "tileset-explicit.json", Json::parse(fetch(of, "tileset-explicit.json")->bytes)["root"], nullptr, glbs);
  EXPECT_GT(glbs.size(), 40U);
}

double real_at(std::string_view bytes, std::size_t at) {
  return std::bit_cast<double>(little_endian_at<std::uint64_t>(bytes, at));
}
float float_at(std::string_view bytes, std::size_t at) {
  return std::bit_cast<float>(little_endian_at<std::uint32_t>(bytes, at));
}

/// A subtree of four levels, read as the specification says.
struct Subtree {
  Json json;
  std::string binary;

  explicit Subtree(const std::string& bytes) {
    const auto size = little_endian_at<std::uint64_t>(bytes, 8);
    EXPECT_EQ(bytes.substr(0, 4), "subt");
    EXPECT_EQ(bytes.size(), 24 + size + little_endian_at<std::uint64_t>(bytes, 16));
    json = Json::parse(bytes.substr(24, size));
    binary = bytes.substr(24 + size);
  }
  bool available(const Json& availability, std::size_t k) const {
    if (availability.contains("constant")) return availability["constant"] == 1;
    const std::size_t at = json["bufferViews"][availability["bitstream"].get<std::size_t>()]["byteOffset"];
    return (binary[at + k / 8] >> (k % 8) & 1) != 0;
  }
  /// Number k of a property's values.
  double value(const char* property, std::size_t k) const {
    const std::size_t view = json["propertyTables"][0]["properties"][property]["values"];
    return real_at(binary, json["bufferViews"][view]["byteOffset"].get<std::size_t>() + 8 * k);
  }
};

/// Earth-centred positions of a tile.
std::vector<Vec3> points_of(const std::string& glb) {
  const auto chunks = unpack_glb(glb).value();
  const Json json = Json::parse(chunks.first);
  const Json& primitive = json["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["extensions"]["CESIUM_tile_edges"].size(), 4U);
  EXPECT_FALSE(json.contains("extensionsRequired"));
  const Json& accessor = json["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()];
  const std::size_t start = json["bufferViews"][accessor["bufferView"].get<std::size_t>()]["byteOffset"];
  const Json& m = json["nodes"][0]["matrix"];
  std::vector<Vec3> out;
  for (std::size_t v = 0; v < accessor["count"].get<std::size_t>(); ++v) {
    std::array<double, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) p[k] = m[12 + k].get<double>() + double{float_at(chunks.second, start + 12 * v + 4 * k)};
    out.push_back({p[0], -p[2], p[1]});
  }
  return out;
}

TEST(TerrainTileset, MetadataHoldEveryTile) {
  std::size_t tiles = 0;
  for (const auto& [root, level, x, y] : {std::tuple{'W', 0, 0, 0}, {'E', 0, 0, 0}, {'W', 4, 15, 10}, {'E', 4, 0, 10}}) {
    const std::string place =
        std::string(1, root) + "/" + std::to_string(level) + "/" + std::to_string(x) + "/" + std::to_string(y);
    const auto document = fetch("terrain3d/subtrees/" + place + ".subtree");
    ASSERT_TRUE(document) << place;
    const Subtree subtree(document->bytes);
    std::size_t row = 0, bit = 0;
    for (int depth = 0; depth < 4; ++depth) {
      for (std::uint32_t morton = 0; morton < 1U << (2 * depth); ++morton, ++bit) {
        std::uint32_t dx = 0, dy = 0;
        for (int k = 0; k < depth; ++k) {
          dx |= (morton >> (2 * k) & 1) << k;
          dy |= (morton >> (2 * k + 1) & 1) << k;
        }
        const std::string path = "terrain3d/" + std::string(1, root) + "/" + std::to_string(level + depth) + "/" +
                                 std::to_string((static_cast<std::uint32_t>(x) << depth) + dx) + "/" +
                                 std::to_string((static_cast<std::uint32_t>(y) << depth) + dy) + ".glb";
        const auto tile = fetch(path);
        ASSERT_EQ(tile.has_value(), subtree.available(subtree.json["tileAvailability"], bit)) << path;
        if (!tile) continue;
        const Vec3 centre{subtree.value("bounding_sphere", 4 * row), subtree.value("bounding_sphere", 4 * row + 1),
                          subtree.value("bounding_sphere", 4 * row + 2)};
        for (const Vec3& p : points_of(tile->bytes)) {
          ASSERT_LE(std::sqrt(dot(p - centre, p - centre)), subtree.value("bounding_sphere", 4 * row + 3)) << path;
        }
        EXPECT_LT(subtree.value("minimum_height", row), subtree.value("maximum_height", row));
        ++row;
        ++tiles;
      }
    }
    EXPECT_EQ(subtree.json["propertyTables"][0]["count"], row);
  }
  EXPECT_GT(tiles, 50U);
}

TEST(TerrainTileset, HeightsAreThoseOfAllBelow) {
  const proto::TileAddress node{kFinest, 130, 80};
  const auto highest = [](int z) { return 1000.0 + 100 * z; };
  const SomeTiles steep(node, node, hills(), [&](proto::TileRecord& record) {
    record.set_max_height(highest(static_cast<int>(record.level())));
    record.set_region(5, record.max_height());
  });
  for (const int z : {0, 4}) {
    const std::string place =
        std::to_string(z) + "/" + std::to_string((130 - 128) >> (kFinest - z)) + "/" + std::to_string(80 >> (kFinest - z));
    const Subtree subtree(steep.fetch("terrain3d/subtrees/E/" + place + ".subtree")->bytes);
    EXPECT_GE(subtree.value("maximum_height", 0), highest(kFinest)) << z;
    EXPECT_LE(subtree.value("maximum_height", 0), highest(kFinest) + 3) << z << ", with what corners are rounded by";
  }
}

/// Levels 0 and 1 have no meshes: they have the heights of those below them.
TEST(TerrainTileset, HeightsOfLevelsWithoutMeshesHoldThoseBelow) {
  const Subtree subtree(fetch("terrain3d/subtrees/E/0/0/0.subtree")->bytes);
  const std::size_t tiles = subtree.json["propertyTables"][0]["count"];
  ASSERT_GT(tiles, 3U);
  for (std::size_t row = 1; row < tiles; ++row) {
    EXPECT_LE(subtree.value("minimum_height", 0), subtree.value("minimum_height", row)) << row;
    EXPECT_GE(subtree.value("maximum_height", 0), subtree.value("maximum_height", row)) << row;
  }
}

TEST(TerrainTileset, EachRootHasItsOwnLevels) {
  const auto levels = [](const std::optional<faces::Document>& document) {
    const Json children = Json::parse(document->bytes)["root"]["children"];
    return std::pair<int, int>(children[0]["implicitTiling"]["availableLevels"],
                               children[1]["implicitTiling"]["availableLevels"]);
  };
  EXPECT_EQ(levels(fetch("terrain3d/tileset.json")), (std::pair{kFinest + 1, kFinest + 1}));
  const SomeTiles east({kFinest, 130, 80}, {kFinest, 131, 80}, hills());
  EXPECT_EQ(levels(east.fetch("terrain3d/tileset.json")), (std::pair{1, kFinest + 1}));
  EXPECT_FALSE(east.fetch("terrain3d/W/1/0/0.glb")) << "level 0 alone is there without data";
}

TEST(TerrainTileset, HasTwoRootsAndTheSemanticsThatTheProviderReads) {
  const Json json = Json::parse(fetch("terrain3d/tileset.json")->bytes);
  ASSERT_EQ(json["root"]["children"].size(), 2U);
  std::set<std::string> semantics;
  for (const auto& [name, property] : json["schema"]["classes"]["tile"]["properties"].items()) {
    semantics.insert(property["semantic"]);
  }
  EXPECT_EQ(semantics, (std::set<std::string>{"TILE_MINIMUM_HEIGHT", "TILE_MAXIMUM_HEIGHT", "TILE_BOUNDING_SPHERE",
                                              "TILE_HORIZON_OCCLUSION_POINT"}));
}

}  // namespace
}  // namespace cordillera::pipeline
