// The light on 3D Tiles: normal maps as a client of glTF reads them, with decoders that are not ours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/region.h"
#include "pipeline/faces/tiles_3d/glb_tile.h"
#include "pipeline/faces/tiles_3d/normal_map.h"
#include "tests/pipeline/gltf_tiles.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;
using proto::TileAddress;
using proto::Vec3;

constexpr auto kPixels = static_cast<std::int32_t>(kNormalMapSide);

constexpr int kFine = 12;  // a tile has 5 km a side
constexpr TileAddress kFirst{kFine, 4200, 2600}, kLast{kFine, 4203, 2603};
const proto::Lattice kFineLattice{kFine};
constexpr TileAddress kInside{kFine, 4201, 2601};

/// Metres a lattice unit eastward and northward; level where it would leave the earth, far from the tile.
Heights plane(double east, double north) {
  return [=](std::int64_t i, std::int64_t j) {
    const double rise =
        east * static_cast<double>(i - kFineLattice.west(kInside)) + north * static_cast<double>(j - kFineLattice.south(kInside));
    return std::clamp(3000 + rise, -8000.0, 14000.0);
  };
}

/// The plane's normal at a place of the lattice.
Vec3 normal_of(const Heights& heights, std::int64_t i, std::int64_t j) {
  const auto at = [&](std::int64_t x, std::int64_t y) {
    return proto::ecef(proto::row_frame(kFineLattice, y), proto::column_frame(kFineLattice, x), *heights(x, y));
  };
  return unit(cross(at(i + 1, j) - at(i - 1, j), at(i, j + 1) - at(i, j - 1)));
}

/// Compares the light at every vertex with the normal of the heights where its position is. away: not so near to lines that part
/// slopes.
void compare_light(const Dataset& dataset, const TileAddress& tile, const Heights& heights,
                   const std::function<bool(std::int64_t, std::int64_t)>& away) {
  const std::string bytes = bytes_of(dataset.terrain(), path_of(tile), "texture");
  const Gltf gltf(bytes);
  const LitSurface& surface = gltf.surfaces[0];
  const std::vector<Vec3> points = decode_glb(bytes)->points;
  ASSERT_EQ(surface.texcoords.size(), points.size());
  const double units = static_cast<double>(kFineLattice.rows()) / M_PI;
  std::size_t compared = 0;
  for (std::size_t v = 0; v < points.size(); ++v) {
    const Geodetic at = geodetic(points[v]);
    const auto i = std::lround((at.longitude + M_PI) * units), j = std::lround((at.latitude + M_PI / 2) * units);
    EXPECT_EQ(surface.tangents[v][3], 1);
    if (!away(i, j)) continue;
    EXPECT_LT(degrees_between(gltf.lit(surface, v), normal_of(heights, i, j)), 0.4) << tile.z << " vertex " << v;
    ++compared;
  }
  EXPECT_GT(compared, points.size() / 2);
}

class Planes : public ::testing::TestWithParam<std::array<double, 2>> {};

TEST_P(Planes, HaveTheirNormalsInGltf) {
  const Heights heights = plane(GetParam()[0], GetParam()[1]);
  const Dataset dataset(kFine, kFirst, kLast, heights);
  for (const TileAddress& tile : {kInside, kInside.parent()}) {
    compare_light(dataset, tile, heights, [](std::int64_t, std::int64_t) { return true; });
  }
}

TEST(NormalMap, LiesOnTheTileAsTheTerrainDoes) {
  // Each quarter of the tile has a slope of its own.
  const std::int64_t column = kFineLattice.west(kInside) + 128, row = kFineLattice.south(kInside) + 128;
  const Heights heights = [=](std::int64_t i, std::int64_t j) {
    const double east = static_cast<double>(i - column), north = static_cast<double>(j - row);
    const double rise = (east < 0 ? 2 : 6) * east + (north < 0 ? 7 : -3) * north;
    return std::clamp(5000 + rise, -8000.0, 14000.0);
  };
  const Dataset dataset(kFine, kFirst, kLast, heights);
  compare_light(dataset, kInside, heights, [=](std::int64_t i, std::int64_t j) { return i != column && j != row; });
}

INSTANTIATE_TEST_SUITE_P(Tilted, Planes,
                         ::testing::Values(std::array{0.0, 0.0}, std::array{6.0, 0.0}, std::array{-4.0, 0.0},
                                           std::array{0.0, 7.0}, std::array{0.0, -9.0}, std::array{5.0, -3.0}));

TEST(NormalMap, OfLevelGroundHasNoSpeckles) {
  const Dataset dataset(kFine, kFirst, kLast, plane(0, 0));
  for (const TileAddress& tile : {kInside, kInside.parent(), kInside.parent().parent()}) {
    const auto pixels = faces::normal_map(dataset.terrain(), tile);
    std::set<std::array<int, 3>> seen;
    for (std::size_t k = 0; k < pixels.size(); k += 3) seen.insert({pixels[k], pixels[k + 1], pixels[k + 2]});
    EXPECT_EQ(seen, (std::set<std::array<int, 3>>{{128, 128, 255}})) << tile.z;
  }
}

std::array<std::uint8_t, 3> pixel(const std::vector<std::uint8_t>& map, std::int32_t row, std::int32_t column) {
  const auto at = 3 * (static_cast<std::size_t>(row) * kNormalMapSide + static_cast<std::size_t>(column));
  return {map[at], map[at + 1], map[at + 2]};
}

/// Every pair of neighbours of every level; how many there were.
std::size_t compare_sides(const Dataset& dataset) {
  std::size_t pairs = 0;
  const auto& store = dataset.terrain().store();
  for (int z = 0; z <= dataset.lattice().finest_level; ++z) {
    const std::int32_t across = proto::tiles_across(z);
    for (const proto::TileRecord& record : store.records(z, 0, 0, across - 1, proto::tiles_up(z) - 1)) {
      const TileAddress tile{z, static_cast<std::int32_t>(record.x()), static_cast<std::int32_t>(record.y())};
      const TileAddress east{z, (tile.x + 1) % across, tile.y}, north{z, tile.x, tile.y + 1};
      const auto own = faces::normal_map(dataset.terrain(), tile);
      if (store.record(east)) {
        const auto other = faces::normal_map(dataset.terrain(), east);
        for (std::int32_t r = 0; r < kPixels; ++r)
          EXPECT_EQ(pixel(own, r, kPixels - 1), pixel(other, r, 0)) << z << " east, row " << r;
        ++pairs;
      }
      if (north.y < proto::tiles_up(z) && store.record(north)) {
        const auto other = faces::normal_map(dataset.terrain(), north);
        for (std::int32_t c = 0; c < kPixels; ++c)
          EXPECT_EQ(pixel(own, 0, c), pixel(other, kPixels - 1, c)) << z << " north, column " << c;
        ++pairs;
      }
    }
  }
  return pairs;
}

TEST(NormalMap, NeighboursAgreeAlongTheirSide) {
  constexpr int kFinest = 7;
  const Dataset dataset(kFinest, {kFinest, 126, 80}, {kFinest, 131, 85}, hills_with_voids());
  EXPECT_GT(compare_sides(dataset), 60U);
}

TEST(NormalMap, NeighboursAgreeAcrossTheAntimeridianAndBesideAPole) {
  constexpr int kFinest = 5;
  const Dataset dataset(kFinest, {{{kFinest, 0, 30}, {kFinest, 1, 31}}, {{kFinest, 62, 30}, {kFinest, 63, 31}}},
                        hills_with_voids(), hills_with_voids());
  EXPECT_GT(compare_sides(dataset), 15U);
}

TEST(NormalMap, ShowsWhatFinerLevelsHave) {
  const Dataset dataset(kFine, {{kFirst, kLast}}, plane(6, 0), plane(0, 0));
  for (int up = 1; up <= faces::kFinerLevels; ++up) {
    TileAddress tile = kInside;
    for (int k = 0; k < up; ++k) tile = tile.parent();
    const auto middle = pixel(faces::normal_map(dataset.terrain(), tile), 3 * kPixels / 4, kPixels / 4);
    EXPECT_LT(middle[0], 110) << "the finest level rises eastward, its parents are level";
  }
}

TEST(NormalMap, BesideTheSurfaceGoesOnForTwoPixels) {
  // Data up to a column inside of a tile.
  constexpr std::int32_t kShore = 128;
  const Heights heights = [slope = plane(6, 0)](std::int64_t i, std::int64_t j) {
    return i <= kFineLattice.west(kInside) + kShore ? slope(i, j) : std::nullopt;
  };
  const Dataset dataset(kFine, kFirst, kLast, heights);
  const auto map = faces::normal_map(dataset.terrain(), kInside);
  const auto at = [&](std::int32_t beyond) { return pixel(map, kPixels / 2, kShore + beyond); };
  EXPECT_LT(at(-1)[0], 110);
  for (const std::int32_t beyond : {0, 1, 2}) EXPECT_NEAR(at(beyond)[0], at(-1)[0], 1) << beyond;
  EXPECT_EQ(at(3), (std::array<std::uint8_t, 3>{128, 128, 255}));
}

/// Every vertex of a tile, by its place in space.
std::map<std::array<double, 3>, Vec3> normals_by_place(const Dataset& dataset, const TileAddress& tile) {
  const auto glb = decode_glb(bytes_of(dataset.terrain(), path_of(tile), "")).value();
  std::map<std::array<double, 3>, Vec3> out;
  for (std::size_t v = 0; v < glb.points.size(); ++v) out[{glb.points[v].x, glb.points[v].y, glb.points[v].z}] = glb.normals[v];
  return out;
}

/// Vertices of a common side; they have the same normal in both tiles.
std::size_t compare_normals(const Dataset& dataset, const TileAddress& one, const TileAddress& other) {
  const auto there = normals_by_place(dataset, other);
  std::size_t common = 0;
  for (const auto& [place, normal] : normals_by_place(dataset, one)) {
    const auto found = there.find(place);
    if (found == there.end()) continue;
    EXPECT_EQ(dot(normal, found->second), dot(normal, normal))
        << one.x << "," << one.y << " beside " << other.x << "," << other.y;
    ++common;
  }
  return common;
}

TEST(NormalsOfVertices, NeighboursAgreeAlongTheirSide) {
  const Dataset dataset(kFine, kFirst, kLast, hills());
  EXPECT_GT(compare_normals(dataset, kInside, {kFine, kInside.x + 1, kInside.y}), 5U);
  EXPECT_GT(compare_normals(dataset, kInside, {kFine, kInside.x, kInside.y + 1}), 5U);
  EXPECT_EQ(compare_normals(dataset, kInside, {kFine, kInside.x + 1, kInside.y + 1}), 1U) << "a corner";
}

/// Blocks are made at different times. Here they are the two halves of the earth.
TEST(NormalsOfVertices, ATileIsTheSameWhateverStandsInOtherBlocks) {
  constexpr TileAddress kEast{5, 32, 16}, kBeside{5, 33, 16}, kWest{5, 31, 16};
  const auto tile = [&](const std::vector<std::pair<TileAddress, TileAddress>>& parts) {
    const Dataset dataset(5, parts, hills(), hills());
    return bytes_of(dataset.terrain(), path_of(kEast), "");
  };
  const std::string alone = tile({{kEast, kEast}});
  EXPECT_EQ(tile({{kWest, kWest}, {kEast, kEast}}), alone);
  EXPECT_NE(tile({{kEast, kBeside}}), alone) << "in its own the neighbour counts";
}

TEST(NormalsOfVertices, OnASideAreThoseOfTheSlope) {
  // A ridge along a side, which neither of its tiles sees alone.
  const std::int64_t ridge = kFineLattice.west(kInside) + kFineLattice.tile_units(kFine);
  const Heights heights = [=](std::int64_t i, std::int64_t) {
    return std::max(1000 - 10.0 * static_cast<double>(std::abs(i - ridge)), -8000.0);
  };
  const Dataset dataset(kFine, kFirst, kLast, heights);
  std::size_t on_ridge = 0;
  for (const auto& [place, normal] : normals_by_place(dataset, kInside)) {
    const Vec3 point{place[0], place[1], place[2]};
    const Geodetic at = geodetic(point);
    if (at.height_m < 999.9) continue;
    EXPECT_LT(degrees_between(normal, point), 1) << "up, but for the ellipsoid's flattening";
    ++on_ridge;
  }
  EXPECT_GT(on_ridge, 1U);
}

class NormalsOf3dTiles : public ::testing::Test {
 protected:
  const Dataset dataset_{kFine, kFirst, kLast, hills()};
  const faces::Terrain& terrain_ = dataset_.terrain();
};

TEST_F(NormalsOf3dTiles, ByDefaultAreThoseOfTheVertices) {
  const std::string lit = bytes_of(terrain_, path_of(kInside), "");
  EXPECT_EQ(bytes_of(terrain_, path_of(kInside), "vertex"), lit);
  EXPECT_EQ(bytes_of(terrain_, "tileset.json", "vertex"), bytes_of(terrain_, "tileset.json", ""));
  const Gltf gltf(lit);
  std::string names;
  for (const auto& [name, value] : gltf.json.items()) names += name + " ";
  EXPECT_EQ(names,
            "asset extensionsUsed extensionsRequired scene scenes nodes meshes materials accessors bufferViews buffers extras ");
  EXPECT_EQ(gltf.json["meshes"][0]["primitives"][0].dump(),
            R"({"attributes":{"POSITION":1,"NORMAL":2},"indices":0,"material":0,"mode":4,)"
            R"("extensions":{"KHR_draco_mesh_compression":{"bufferView":0,"attributes":{"POSITION":0,"NORMAL":1}}}})");
  EXPECT_EQ(gltf.json["extensionsUsed"], Json::array({"KHR_draco_mesh_compression"}));
  EXPECT_EQ(gltf.json["extensionsRequired"], gltf.json["extensionsUsed"]);
  EXPECT_TRUE(gltf.surfaces[0].tangents.empty() && gltf.surfaces[0].texcoords.empty());
}

TEST_F(NormalsOf3dTiles, NoneAreNotThere) {
  const Gltf gltf(bytes_of(terrain_, path_of(kInside), "none"));
  for (const Json& primitive : gltf.json["meshes"][0]["primitives"])
    EXPECT_EQ(primitive["attributes"].size(), 1U) << primitive.dump();
  for (const LitSurface& surface : gltf.surfaces) EXPECT_TRUE(surface.normals.empty());
  EXPECT_FALSE(gltf.json.contains("images"));
  EXPECT_TRUE(decode_glb(bytes_of(terrain_, path_of(kInside), "none")).ok());
}

TEST_F(NormalsOf3dTiles, TextureIsAPictureAndAFrame) {
  const Gltf gltf(bytes_of(terrain_, path_of(kInside), "texture"));
  EXPECT_EQ(gltf.normal_map.width, kPixels);
  EXPECT_EQ(gltf.normal_map.height, kPixels);
  EXPECT_EQ(gltf.json["extensionsRequired"], Json::array({"KHR_draco_mesh_compression", "EXT_texture_webp"}));
  EXPECT_EQ(gltf.json["materials"][0]["normalTexture"], Json({{"index", 0}}));
  const Gltf plain(bytes_of(terrain_, path_of(kInside), ""));
  for (std::size_t k = 0; k < gltf.surfaces.size(); ++k) {
    EXPECT_EQ(gltf.surfaces[k].positions.size(), plain.surfaces[k].positions.size());
    EXPECT_EQ(gltf.surfaces[k].triangles.size(), plain.surfaces[k].triangles.size());
  }
  EXPECT_EQ(gltf.json["nodes"], plain.json["nodes"]);
}

TEST_F(NormalsOf3dTiles, SkirtsHaveTheTexelsOfTheRim) {
  const Gltf gltf(bytes_of(terrain_, path_of(kInside), "texture"));
  ASSERT_EQ(gltf.surfaces.size(), 2U);
  const LitSurface& skirts = gltf.surfaces[1];
  ASSERT_EQ(skirts.texcoords.size(), skirts.positions.size());
  ASSERT_EQ(skirts.tangents.size(), skirts.positions.size());
  const auto outer = [](float t) {
    return std::min(std::abs(t * kPixels - 0.5), std::abs(t * kPixels - (kPixels - 0.5))) < 1e-3;
  };
  for (const auto& [u, v] : skirts.texcoords) EXPECT_TRUE(outer(u) || outer(v)) << u << " " << v;
}

TEST_F(NormalsOf3dTiles, NeighboursHaveOneFrame) {
  const Gltf west(bytes_of(terrain_, path_of(kInside), "texture"));
  const Gltf east(bytes_of(terrain_, path_of({kFine, kInside.x + 1, kInside.y}), "texture"));
  const auto side = [](const Gltf& gltf, float u) {
    std::set<std::pair<float, std::array<float, 7>>> out;  // v, normal and tangent
    const LitSurface& s = gltf.surfaces[0];
    for (std::size_t k = 0; k < s.positions.size(); ++k) {
      if (std::abs(s.texcoords[k][0] - u) > 1e-5F) continue;
      const auto& n = s.normals[k];
      const auto& t = s.tangents[k];
      out.insert({s.texcoords[k][1], {n[0], n[1], n[2], t[0], t[1], t[2], t[3]}});
    }
    return out;
  };
  EXPECT_EQ(side(west, (kPixels - 0.5F) / kPixels), side(east, 0.5F / kPixels));
  EXPECT_EQ(side(east, 0.5F / kPixels).size(), 9U);
}

TEST_F(NormalsOf3dTiles, AreTheSameBytesEveryTime) {
  const faces::Terrain again(std::shared_ptr<const StoreReader>(&terrain_.store(), [](const StoreReader*) {}));
  const std::string bytes = bytes_of(terrain_, path_of(kInside.parent()), "texture");
  EXPECT_EQ(bytes_of(again, path_of(kInside.parent()), "texture"), bytes);
  EXPECT_EQ(
      bytes_of(terrain_, "tiles/E/11/" + std::to_string(kInside.x / 2 - 2048) + "/" + std::to_string(kInside.y / 2) + ".glb",
               "texture"),
      bytes);
}

TEST_F(NormalsOf3dTiles, TagsAreThoseOfTheBytes) {
  for (const char* normals : {"", "vertex", "none", "texture"}) {
    auto found = faces::find(path_of(kInside));
    found->place.normals = normals;
    const auto tag = found->resource->tag(terrain_, found->place);
    EXPECT_EQ(tag, (*found->resource->make(terrain_, found->place))->etag) << normals;
  }
}

TEST_F(NormalsOf3dTiles, OfTilesThatAreNotThereAreNotThere) {
  for (const char* normals : {"none", "texture"}) {
    auto found = faces::find("tiles/12/0/0.glb");
    found->place.normals = normals;
    const auto made = found->resource->make(terrain_, found->place);
    EXPECT_TRUE(made.ok() && !*made) << normals;
    EXPECT_FALSE(found->resource->tag(terrain_, found->place));
  }
}

TEST_F(NormalsOf3dTiles, OfOtherNamesAreRefused) {
  for (const char* path :
       {"tileset.json", "tileset-explicit.json", "explicit/0/1/0.json", "tiles/12/4201/2601.glb", "tiles/E/12/105/2601.glb"}) {
    for (const char* normals : {"textures", "Texture", "\n"}) {
      auto found = faces::find(path);
      ASSERT_TRUE(found) << path;
      EXPECT_FALSE(found->resource->normals.empty());
      found->place.normals = normals;
      const auto made = found->resource->make(terrain_, found->place);
      ASSERT_FALSE(made.ok()) << path;
      EXPECT_EQ(made.problem().type, "option-invalid");
      EXPECT_EQ(made.problem().accepted, faces::kNormals);
      EXPECT_FALSE(found->resource->tag != nullptr && found->resource->tag(terrain_, found->place));
    }
  }
}

TEST_F(NormalsOf3dTiles, GoFromATilesetToItsTiles) {
  const Json tileset = Json::parse(bytes_of(terrain_, "tileset.json", "texture"));
  EXPECT_EQ(tileset["root"]["children"][0]["content"]["uri"], "tiles/E/{level}/{x}/{y}.glb?normals=texture");
  EXPECT_EQ(tileset["root"]["children"][0]["implicitTiling"]["subtrees"]["uri"], "subtrees/E/{level}/{x}/{y}.subtree");
  const Json top = Json::parse(bytes_of(terrain_, "tileset-explicit.json", "none"));
  EXPECT_EQ(top["root"]["children"][0]["content"]["uri"], "explicit/0/1/0.json?normals=none");
  const std::string part = bytes_of(terrain_, "explicit/0/1/0.json", "none");
  EXPECT_NE(part.find("../../../tiles/E/0/0/0.glb?normals=none"), part.npos) << part;
}

}  // namespace
}  // namespace cordillera::pipeline
