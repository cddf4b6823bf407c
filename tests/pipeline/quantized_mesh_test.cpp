#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>
#include <random>
#include <set>

#include "pipeline/encode/json.h"
#include "tests/pipeline/quantized_mesh_dataset.h"
#include "tests/pipeline/quantized_mesh_decoder.h"

namespace cordillera::pipeline {
namespace {

using proto::TileAddress;
using proto::Vec3;
using namespace testing;

constexpr int kMost = 32767;

/// One of the two tiling schemes that the format is served in.
struct Layer {
  std::string folder;  ///< of layer.json
  std::string projection;
  int finest = 0;
  int roots = 0;  ///< tiles of level 0, side by side

  std::int32_t across(int z) const { return roots << z; }
  /// Angles of a tile's corners: west, south, width, height.
  std::array<double, 4> angles(const TileAddress& t) const {
    const double pi = std::numbers::pi, width = 2 * pi / across(t.z);
    if (roots == 2) return {t.x * width - pi, t.y * width - pi / 2, width, width};
    const auto parallel = [&](int y) { return std::atan(std::sinh(pi * (2 * std::ldexp(y, -t.z) - 1))); };
    return {t.x * width - pi, parallel(t.y), width, parallel(t.y + 1) - parallel(t.y)};
  }
};
const Layer kGeodetic{"", "EPSG:4326", kFinest, 2}, kMercator{"web-mercator/", "EPSG:3857", kFinest + 1, 1};

std::string path_of(const Layer& layer, const TileAddress& t) {
  return layer.folder + "terrain/" + std::to_string(t.z) + "/" + std::to_string(t.x) + "/" + std::to_string(t.y) + ".terrain";
}

/// Every tile that layer.json lists, decoded.
std::map<TileAddress, DecodedTerrain> tiles_of(const Layer& which) {
  std::map<TileAddress, DecodedTerrain> out;
  for (const TileAddress& at : listed_in(Json::parse(fetch(which.folder + "layer.json")->bytes))) {
    const auto document = fetch(path_of(which, at));
    EXPECT_TRUE(document) << at.z << " " << at.x << " " << at.y;
    if (document) out.emplace(at, TerrainReader(document->bytes).read());
  }
  return out;
}
const std::map<TileAddress, DecodedTerrain>& all_tiles(const Layer& layer = kGeodetic) {
  static std::map<std::string, std::map<TileAddress, DecodedTerrain>> made;
  const auto [found, fresh] = made.try_emplace(layer.folder);
  if (fresh) found->second = tiles_of(layer);
  return found->second;
}

std::string name(const TileAddress& t) { return path_of(kGeodetic, t); }

/// What holds in both schemes.
class QuantizedMeshIn : public ::testing::TestWithParam<Layer> {};
INSTANTIATE_TEST_SUITE_P(Schemes, QuantizedMeshIn, ::testing::Values(kGeodetic, kMercator), [](const auto& scheme) {
  return std::string(scheme.param.roots == 2 ? "WorldCRS84Quad" : "WebMercatorQuad");
});

/// u, v and the height as the client has it.
using Corner = std::tuple<int, int, double>;
Corner corner(const DecodedTerrain& tile, std::uint32_t v) {
  return {tile.vertices[v][0], tile.vertices[v][1], tile.height_m(v)};
}

/// Directed edges that no other triangle runs the other way, as many times as they occur.
std::multiset<std::pair<Corner, Corner>> open_edges(const DecodedTerrain& tile) {
  std::multiset<std::pair<Corner, Corner>> open;
  for (const auto& t : tile.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::pair edge{corner(tile, t[k]), corner(tile, t[(k + 1) % 3])};
      if (const auto back = open.find({edge.second, edge.first}); back != open.end()) {
        open.erase(back);
      } else
        open.insert(edge);
    }
  }
  return open;
}

bool on_side(const Corner& c, std::size_t side) {
  return side == 0   ? std::get<0>(c) == 0
         : side == 1 ? std::get<1>(c) == 0
         : side == 2 ? std::get<0>(c) == kMost
                     : std::get<1>(c) == kMost;
}

/// The line along a side, from the south or the west; what is upright at a corner belongs to no side.
std::multiset<std::tuple<int, double, int, double>> line_of(const DecodedTerrain& tile, std::size_t side) {
  std::multiset<std::tuple<int, double, int, double>> out;
  for (auto [a, b] : open_edges(tile)) {
    if (!on_side(a, side) || !on_side(b, side)) continue;
    const bool upright = side % 2 == 0, backward = side == 0 || side == 3;
    if (backward) std::swap(a, b);
    const int from = upright ? std::get<1>(a) : std::get<0>(a), to = upright ? std::get<1>(b) : std::get<0>(b);
    if (from == to && (from == 0 || from == kMost)) continue;
    out.insert({from, std::get<2>(a), to, std::get<2>(b)});
  }
  return out;
}

TEST_P(QuantizedMeshIn, CoversEveryRectangleExactly) {
  ASSERT_GT(all_tiles(GetParam()).size(), 60U);
  std::size_t walls = 0;
  for (const auto& [at, tile] : all_tiles(GetParam())) {
    std::int64_t sum = 0;
    for (std::size_t t = 0; t < tile.triangles.size(); ++t) {
      const std::int64_t area = tile.twice_area(t);
      ASSERT_GE(area, 0) << name(at);
      walls += area == 0 ? 1 : 0;
      sum += area;
    }
    EXPECT_EQ(sum, std::int64_t{2} * kMost * kMost) << name(at);
  }
  EXPECT_GT(walls, 1000U);
}

TEST_P(QuantizedMeshIn, HasNoHolesInside) {
  for (const auto& [at, tile] : all_tiles(GetParam())) {
    for (const auto& [a, b] : open_edges(tile)) {
      bool side = false;
      for (std::size_t k = 0; k < 4; ++k) side = side || (on_side(a, k) && on_side(b, k));
      ASSERT_TRUE(side) << name(at) << " " << std::get<0>(a) << " " << std::get<1>(a) << " " << std::get<2>(a);
    }
  }
}

TEST_P(QuantizedMeshIn, NeighboursHaveTheSameLineAndNormals) {
  std::size_t pairs = 0, rough = 0;
  for (const auto& [at, tile] : all_tiles(GetParam())) {
    for (const std::size_t side : {2U, 3U}) {  // east, north
      TileAddress other = at;
      if (side == 2) {
        other.x = (at.x + 1) % GetParam().across(at.z);
      } else
        ++other.y;
      const auto found = all_tiles(GetParam()).find(other);
      if (found == all_tiles(GetParam()).end()) continue;
      const auto mine = line_of(tile, side), theirs = line_of(found->second, side - 2);
      ASSERT_EQ(mine, theirs) << name(at) << " and " << name(other);
      ++pairs;
      rough += mine.size() > 4 ? 1 : 0;
      std::map<std::pair<int, double>, Vec3> normals;
      const std::size_t along = side == 2 ? 1 : 0;
      for (const std::uint32_t v : tile.sides[side]) normals[{tile.vertices[v][along], tile.height_m(v)}] = tile.normals[v];
      for (const std::uint32_t v : found->second.sides[side - 2]) {
        const auto same = normals.find({found->second.vertices[v][along], found->second.height_m(v)});
        if (same == normals.end() || same->first.first % kMost == 0) continue;
        ASSERT_GT(dot(same->second, found->second.normals[v]), 0.99999) << name(at);
      }
    }
  }
  EXPECT_GT(pairs, 80U);
  EXPECT_GT(rough, 40U);
}

/// Where a vertex stands on its side, in the order in which CesiumJS sorts it: the western side and the northern one rising, the
/// others falling.
int along_as_cesium_sorts(const DecodedTerrain& tile, std::size_t side, std::uint32_t v) {
  const int along = tile.vertices[v][side % 2 == 0 ? 1 : 0];
  return side == 0 || side == 3 ? along : -along;
}

TEST_P(QuantizedMeshIn, SideListsAreCompleteAndInOrder) {
  for (const auto& [at, tile] : all_tiles(GetParam())) {
    for (std::size_t side = 0; side < 4; ++side) {
      std::set<std::uint32_t> wanted;
      for (std::uint32_t v = 0; v < tile.vertices.size(); ++v) {
        if (on_side({tile.vertices[v][0], tile.vertices[v][1], 0}, side)) wanted.insert(v);
      }
      EXPECT_EQ(std::set<std::uint32_t>(tile.sides[side].begin(), tile.sides[side].end()), wanted) << name(at);
      EXPECT_EQ(tile.sides[side].size(), wanted.size());
      const auto along = [&](std::uint32_t v) { return along_as_cesium_sorts(tile, side, v); };
      EXPECT_TRUE(
          std::is_sorted(tile.sides[side].begin(), tile.sides[side].end(), [&](auto a, auto b) { return along(a) < along(b); }));
      EXPECT_EQ(along(tile.sides[side].back()) - along(tile.sides[side].front()), kMost);
    }
  }
}

// A side's vertices that follow each other are an edge of the surface, also where a wall stands on the side.
TEST_P(QuantizedMeshIn, SkirtsHangOnEdges) {
  std::array<int, 4> walls{};
  for (const auto& [at, tile] : all_tiles(GetParam())) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : tile.triangles) {
      for (std::size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
    }
    for (std::size_t side = 0; side < 4; ++side) {
      const auto along = [&](std::uint32_t v) { return along_as_cesium_sorts(tile, side, v); };
      std::vector<std::uint32_t> sorted = tile.sides[side];
      std::stable_sort(sorted.begin(), sorted.end(), [&](auto a, auto b) { return along(a) < along(b); });
      for (std::size_t k = 1; k < sorted.size(); ++k) {
        if (along(sorted[k - 1]) == along(sorted[k]))
          ++walls[side];
        else
          EXPECT_TRUE(edges.contains(std::minmax(sorted[k - 1], sorted[k]))) << name(at) << ", side " << side;
      }
    }
  }
  for (const int count : walls) EXPECT_GT(count, 5);
}

TEST(QuantizedMesh, DataKeepsItsHeightsUpToItsRim) {
  const Json layer = Json::parse(fetch("layer.json")->bytes);
  std::size_t checked = 0;
  for (const auto& [at, tile] : all_tiles()) {
    const auto mesh = terrain().mesh(at);
    if (!mesh) continue;
    const double step_m = layer["cordillera"]["levels"][static_cast<std::size_t>(at.z)]["height_step"];
    std::map<std::pair<int, int>, std::vector<double>> heights;
    for (std::size_t v = 0; v < tile.vertices.size(); ++v) {
      heights[{tile.vertices[v][0], tile.vertices[v][1]}].push_back(tile.height_m(v));
    }
    for (const auto& [u, v, h] : mesh->mesh().points) {
      const double x = double{kMost} * u / mesh->mesh().side, y = double{kMost} * v / mesh->mesh().side;
      double nearest_m = 1e9;
      for (int i = std::max(0, static_cast<int>(x) - 1); i <= static_cast<int>(x) + 2; ++i) {
        for (int j = std::max(0, static_cast<int>(y) - 1); j <= static_cast<int>(y) + 2; ++j) {
          if (std::abs(i - x) > 1 || std::abs(j - y) > 1) continue;
          for (const double height_m : heights[{i, j}]) {
            nearest_m = std::min(nearest_m, std::abs(height_m - h * mesh->mesh().height_step));
          }
        }
      }
      ASSERT_LE(nearest_m, step_m / 2 + 1e-9) << name(at) << " " << u << " " << v;
      ++checked;
    }
  }
  EXPECT_GT(checked, 3000U);
}

/// The tile's height over a place in quanta, in plan as clients interpolate it.
std::optional<double> height_at(const DecodedTerrain& tile, double u, double v) {
  for (std::size_t t = 0; t < tile.triangles.size(); ++t) {
    const double area = static_cast<double>(tile.twice_area(t));
    if (area == 0) continue;
    std::array<double, 3> share{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto &b = tile.vertices[tile.triangles[t][(k + 1) % 3]], &c = tile.vertices[tile.triangles[t][(k + 2) % 3]];
      share[k] = ((b[0] - u) * (c[1] - v) - (b[1] - v) * (c[0] - u)) / area;
    }
    if (*std::min_element(share.begin(), share.end()) < 0) continue;
    double height_m = 0;
    for (std::size_t k = 0; k < 3; ++k) height_m += share[k] * tile.height_m(tile.triangles[t][k]);
    return height_m;
  }
  return std::nullopt;
}

TEST(QuantizedMesh, DataIsWhereItIsAndTheSeaElsewhere) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(0, kMost);
  std::size_t data = 0, sea = 0;
  for (const auto& [at, tile] : all_tiles()) {
    if (at.z < 3) continue;
    const auto mesh = terrain().mesh(at);
    for (int n = 0; n < 30; ++n) {
      const double u = anywhere(random), v = anywhere(random), side = static_cast<double>(kLattice.tile_units(at.z)) / kMost;
      const auto triangle = mesh ? mesh->triangle_at(u * side, v * side) : std::nullopt;
      const auto height_m = height_at(tile, u, v);
      ASSERT_TRUE(height_m) << name(at);
      if (triangle) {
        // Half a step, and what a triangle as steep as these gains over a quantum.
        double low = 1e9, high = -1e9;
        for (const std::uint32_t corner : mesh->mesh().triangles[*triangle]) {
          low = std::min(low, mesh->mesh().points[corner][2] * mesh->mesh().height_step);
          high = std::max(high, mesh->mesh().points[corner][2] * mesh->mesh().height_step);
        }
        EXPECT_GE(*height_m, low - 2) << name(at) << " " << u << " " << v;
        EXPECT_LE(*height_m, high + 2) << name(at) << " " << u << " " << v;
        ++data;
      } else {
        const double longitude = -180 + 180 / std::ldexp(1, at.z) * (at.x + u / kMost),
                     latitude = -90 + 180 / std::ldexp(1, at.z) * (at.y + v / kMost);
        const auto geoid = terrain().undulation_m(longitude, latitude);
        EXPECT_NEAR(*height_m, geoid.ok() ? *geoid : 0.0, 10) << name(at) << " " << u << " " << v;
        ++sea;
      }
    }
  }
  EXPECT_GT(data, 300U);
  EXPECT_GT(sea, 300U);
}

Vec3 position(const Layer& layer, const TileAddress& at, const DecodedTerrain& tile, std::size_t v) {
  const auto [west, south, width, height] = layer.angles(at);
  const double e2 = proto::kFlattening * (2 - proto::kFlattening);
  const double longitude = west + width * tile.vertices[v][0] / 32767.0,
               latitude = south + height * tile.vertices[v][1] / 32767.0, h = tile.height_m(v);
  const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * std::sin(latitude) * std::sin(latitude));
  return {(n + h) * std::cos(latitude) * std::cos(longitude), (n + h) * std::cos(latitude) * std::sin(longitude),
          (n * (1 - e2) + h) * std::sin(latitude)};
}

/// As clients test it: cut by the plane of the horizon and inside its cone. Everything in the space where the ellipsoid is a unit
/// sphere.
bool behind_horizon(Vec3 camera, Vec3 point) {
  const Vec3 to_point = point - camera;
  const double limb2 = dot(camera, camera) - 1, towards = -dot(to_point, camera);
  return towards > limb2 && towards * towards / dot(to_point, to_point) > limb2;
}

TEST_P(QuantizedMeshIn, BoundsHoldTheTile) {
  std::mt19937 random(11);
  std::normal_distribution<double> any;
  std::size_t hidden = 0;
  for (const auto& [at, tile] : all_tiles(GetParam())) {
    const double low_m = std::min(0.0, static_cast<double>(tile.low_m));
    const double a = proto::kSemiMajor_m + low_m, b = proto::kSemiMajor_m * (1 - proto::kFlattening) + low_m;
    const auto scaled = [&](Vec3 p) { return Vec3{p.x / a, p.y / a, p.z / b}; };
    std::vector<Vec3> points;
    for (std::size_t v = 0; v < tile.vertices.size(); ++v) {
      const Vec3 p = position(GetParam(), at, tile, v), d = p - tile.sphere_centre;
      ASSERT_LE(std::sqrt(dot(d, d)), tile.radius_m) << name(at);
      ASSERT_LE(tile.vertices[v][2], kMost);
      points.push_back(scaled(p));
    }
    for (int n = 0; n < 40; ++n) {
      Vec3 camera{any(random), any(random), any(random)};
      camera = ((1 + 0.002 * (n % 20 + 1) * (n % 20 + 1)) / std::sqrt(dot(camera, camera))) * camera;
      if (!behind_horizon(camera, tile.horizon)) continue;
      ++hidden;
      for (const Vec3& p : points) ASSERT_TRUE(behind_horizon(camera, p)) << name(at);
    }
  }
  EXPECT_GT(hidden, 500U);
}

TEST(QuantizedMesh, LayerListsWhatThereIs) {
  const Json layer = Json::parse(fetch("layer.json")->bytes);
  EXPECT_EQ(layer["format"], "quantized-mesh-1.0");
  EXPECT_EQ(layer["scheme"], "tms");
  EXPECT_EQ(layer["minzoom"], 0);
  EXPECT_EQ(layer["maxzoom"], kFinest);
  EXPECT_EQ(layer["available"].size(), kFinest + 1U);
  EXPECT_EQ(layer["attribution"], "Nobody &lt;nobody@example.org&gt;");
  // Both roots, and whole families: a client that wants one of four children asks for all of them.
  EXPECT_TRUE(all_tiles().contains({0, 0, 0}) && all_tiles().contains({0, 1, 0}));
  std::set<TileAddress> families, wanted;
  for (const auto& [at, tile] : all_tiles()) {
    if (at.z > 0) families.insert(at.parent());
  }
  for (int z = 1; z <= kFinest; ++z) {
    for (const TileExtent& node : terrain().store().extents(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1)) {
      wanted.insert(node.tile.parent());
    }
  }
  EXPECT_EQ(families, wanted);
  EXPECT_EQ(all_tiles().size(), 2 + 4 * families.size());
  EXPECT_FALSE(fetch("terrain/7/0/0.terrain"));
  EXPECT_FALSE(fetch("terrain/8/255/165.terrain"));
}

TEST(QuantizedMesh, LayerOfWebMercatorListsWhatThereIs) {
  const Json layer = Json::parse(fetch("web-mercator/layer.json")->bytes);
  EXPECT_EQ(layer["projection"], "EPSG:3857");
  EXPECT_EQ(layer["scheme"], "tms");
  EXPECT_EQ(layer["maxzoom"], kFinest + 1);
  EXPECT_EQ(layer["available"].size(), kFinest + 2U);
  EXPECT_EQ(layer["available"][0], Json::parse(R"([{"startX":0,"startY":0,"endX":0,"endY":0}])"));
  std::set<TileAddress> families;
  for (const auto& [at, tile] : all_tiles(kMercator)) {
    if (at.z > 0) families.insert(at.parent());
  }
  EXPECT_EQ(all_tiles(kMercator).size(), 1 + 4 * families.size());
  for (const TileAddress& parent : families) EXPECT_TRUE(all_tiles(kMercator).contains(parent)) << path_of(kMercator, parent);
  EXPECT_FALSE(fetch("web-mercator/terrain/8/0/0.terrain"));
}

TEST(QuantizedMesh, LevelsAboveTheCoarsestShowItsHeights) {
  // A vertex of level 1's grid in the data: level 2 has its height there.
  double highest_m = -1e9;
  for (const auto& [at, tile] : all_tiles()) {
    if (at.z != 1) continue;
    for (std::size_t v = 0; v < tile.vertices.size(); ++v) highest_m = std::max(highest_m, tile.height_m(v));
  }
  EXPECT_GT(highest_m, 200);
  EXPECT_LT(highest_m, 1700);
}

}  // namespace
}  // namespace cordillera::pipeline
