#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/glb.h"
#include "pipeline/encode/json.h"
#include "pipeline/encode/region.h"
#include "tests/pipeline/drc_point.h"
#include "tests/pipeline/encode_synthetic.h"
#include "tests/pipeline/triangle_soup.h"

namespace cordillera::pipeline {
namespace {

using proto::Lattice;
using proto::TileAddress;
using proto::TileMesh;
using proto::Vec3;
using testing::encode_input;
using testing::Heights;
using testing::hills;
using testing::hills_with_voids;
using testing::Key;
using testing::key;
using testing::soup;
using testing::synthetic_mesh;

const Lattice kLattice{9};

struct Tile {
  TileMesh mesh;
  EncodeInput input;
  DecodedDrc drc;
  DecodedGlb glb;
};

std::unique_ptr<Tile> make_tile(TileAddress address, const Heights& heights, std::int32_t cells = 32,
                                const Lattice& lattice = kLattice) {
  auto tile = std::make_unique<Tile>();
  tile->mesh = synthetic_mesh(lattice, address, cells, heights);
  tile->input = encode_input(lattice, address, tile->mesh);
  auto drc = decode_drc(encode_drc(tile->input));
  auto glb = decode_glb(encode_glb(tile->input));
  EXPECT_TRUE(drc.ok()) << drc.problem().line();
  EXPECT_TRUE(glb.ok()) << glb.problem().line();
  tile->drc = *drc;
  tile->glb = *glb;
  return tile;
}

// Every edge has at most two triangles, in opposite directions; the triangles of every vertex are one fan.
void expect_manifold(std::size_t vertices, const std::vector<Triangle>& triangles) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  std::vector<int> around(vertices), out_without_twin(vertices);
  for (const Triangle& t : triangles) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_TRUE(directed.insert({t[c], t[(c + 1) % 3]}).second) << "two triangles run along one edge in the same direction";
      ++around[t[c]];
    }
  }
  for (const auto& [a, b] : directed) out_without_twin[a] += !directed.contains({b, a});
  for (std::size_t v = 0; v < vertices; ++v) {
    EXPECT_GT(around[v], 0) << "a vertex without triangles";
    EXPECT_LE(out_without_twin[v], 1) << "two rims pass through one vertex";
  }
}

TEST(EncodeDrc, KeepsEveryIntegerAndTheAddress) {
  const TileAddress address{7, 200, 90};
  const auto tile = make_tile(address, hills());
  std::vector<std::array<std::int32_t, 3>> points;
  for (std::size_t v = 0; v < tile->mesh.vertices(); ++v)
    points.push_back({tile->mesh.x[v], tile->mesh.y[v], tile->mesh.height[v]});
  EXPECT_EQ(soup(points, tile->mesh.triangles), soup(tile->drc.points, tile->drc.triangles));
  EXPECT_EQ(tile->drc.z, 7);
  EXPECT_EQ(tile->drc.x, 200);
  EXPECT_EQ(tile->drc.y, 90);
  EXPECT_EQ(tile->drc.side, kLattice.tile_units(7));
  EXPECT_EQ(tile->drc.height_step, proto::kHeightStep_m);
}

TEST(EncodeDrc, FormulaGivesTheLatticesPlaces) {
  const auto tile = make_tile({7, 200, 90}, hills());
  for (std::size_t p = 0; p < tile->drc.points.size(); ++p) {
    const auto& [u, v, h] = tile->drc.points[p];
    const DrcPoint place = drc_point(tile->drc, p);
    EXPECT_NEAR(place.longitude_deg, kLattice.longitude_deg(kLattice.west({7, 200, 90}) + u), 1e-12);
    EXPECT_NEAR(place.latitude_deg, kLattice.latitude_deg(kLattice.south({7, 200, 90}) + v), 1e-12);
    EXPECT_EQ(place.height_m, h / 1024.0);
  }
}

TEST(EncodeDrc, HoldsTheLargestTileThereIs) {
  const Lattice deepest{proto::kMaxLevel};
  const auto tile = make_tile({0, 1, 0}, hills(), 16, deepest);
  std::int32_t greatest = 0;
  for (const auto& p : tile->drc.points) greatest = std::max({greatest, p[0], p[1]});
  EXPECT_EQ(greatest, proto::kTileCells << proto::kMaxLevel);
}

TEST(Encode, SameInputSameBytes) {
  const TileMesh mesh = synthetic_mesh(kLattice, {8, 411, 170}, 64, hills_with_voids());
  const EncodeInput input = encode_input(kLattice, {8, 411, 170}, mesh);
  EXPECT_EQ(encode_drc(input), encode_drc(input));
  EXPECT_EQ(encode_glb(input), encode_glb(input));
}

TEST(Encode, NothingPublishedIsNoBytes) {
  const TileMesh mesh = synthetic_mesh(kLattice, {8, 411, 170}, 8, [](auto, auto) { return std::nullopt; });
  const EncodeInput input = encode_input(kLattice, {8, 411, 170}, mesh);
  EXPECT_EQ(encode_drc(input), "");
  EXPECT_EQ(encode_glb(input), "");
}

TEST(EncodeGlb, CarriesTitleAndAttribution) {
  const TileMesh mesh = synthetic_mesh(kLattice, {8, 411, 170}, 8, hills());
  EncodeInput input = encode_input(kLattice, {8, 411, 170}, mesh);
  const auto asset = [&] { return Json::parse(unpack_glb(encode_glb(input))->first)["asset"]; };
  EXPECT_EQ(asset()["copyright"], "Made \"by\" hand");
  EXPECT_FALSE(asset().contains("extras")) << "a dataset without a title";
  input.title = "Hills & hollows";
  EXPECT_EQ(asset()["extras"]["title"], "Hills & hollows");
}

TEST(Encode, TouchingRimsAreSplitIntoManifolds) {
  const auto tile = make_tile({9, 800, 300}, hills_with_voids(), 256);
  // Without the split vertices the decoded mesh would have as many points as there are distinct positions.
  std::set<std::array<std::int32_t, 3>> distinct(tile->drc.points.begin(), tile->drc.points.end());
  EXPECT_GT(tile->drc.points.size(), distinct.size()) << "the input has no rims that touch: the test tests nothing";
  expect_manifold(tile->drc.points.size(), tile->drc.triangles);
  expect_manifold(tile->glb.points.size(), tile->glb.triangles);
  expect_manifold(tile->glb.skirt_points.size(), tile->glb.skirt_triangles);
  EXPECT_EQ(tile->drc.triangles.size(), tile->glb.triangles.size());
}

// The points of a tile on one of its sides, as the lattice knows them.
std::set<std::array<std::int64_t, 3>> drc_side(const Tile& tile, int axis, std::int32_t at) {
  std::set<std::array<std::int64_t, 3>> out;
  for (const auto& p : tile.drc.points) {
    const std::int64_t i = (kLattice.west(tile.input.tile) + p[0]) % kLattice.columns();
    if (p[static_cast<std::size_t>(axis)] == at) out.insert({i, kLattice.south(tile.input.tile) + p[1], p[2]});
  }
  return out;
}

// Points of a that are also points of b, bit by bit.
std::size_t common_points(const DecodedGlb& a, const DecodedGlb& b) {
  std::set<Key> of_a, of_b, both;
  for (const Vec3& p : a.points) of_a.insert(key(p));
  for (const Vec3& p : b.points) of_b.insert(key(p));
  std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(), std::inserter(both, both.end()));
  return both.size();
}

TEST(Encode, NeighboursDecodeToTheSamePoints) {
  const TileAddress places[] = {{9, 800, 300}, {9, 1023, 255}, {6, 0, 63}, {6, 127, 40}, {1, 1, 0}, {0, 0, 0}};
  for (const TileAddress& t : places) {
    const TileAddress east{t.z, (t.x + 1) % proto::tiles_across(t.z), t.y};
    const auto a = make_tile(t, hills_with_voids()), b = make_tile(east, hills_with_voids());
    const auto shared = drc_side(*a, 0, a->mesh.side);
    EXPECT_EQ(shared, drc_side(*b, 0, 0)) << t.z << '/' << t.x << '/' << t.y;
    EXPECT_GE(common_points(a->glb, b->glb), t.y == proto::tiles_up(t.z) - 1 || t.z < 2 ? shared.size() - 2 : shared.size());
    if (t.y + 1 == proto::tiles_up(t.z)) continue;
    const auto c = make_tile({t.z, t.x, t.y + 1}, hills_with_voids());
    const auto up = drc_side(*a, 1, a->mesh.side);
    EXPECT_GT(up.size(), 8U);
    EXPECT_EQ(up, drc_side(*c, 1, 0));
    EXPECT_GE(common_points(a->glb, c->glb), up.size());
  }
}

TEST(EncodeGlb, PointsAreTheRoundedEllipsoidPoints) {
  const TileAddress address{9, 800, 300};
  const auto tile = make_tile(address, hills());
  const double step = tile->input.ecef_steps.finest_m;
  const auto rows = proto::row_frames(kLattice, kLattice.south(address), static_cast<std::size_t>(tile->mesh.side) + 1);
  const auto columns = proto::column_frames(kLattice, kLattice.west(address), static_cast<std::size_t>(tile->mesh.side) + 1);
  std::vector<Key> expected, decoded;
  for (std::size_t v = 0; v < tile->mesh.vertices(); ++v) {
    const Vec3 p = proto::ecef(rows[static_cast<std::size_t>(tile->mesh.y[v])],
                               columns[static_cast<std::size_t>(tile->mesh.x[v])], tile->mesh.height[v] * proto::kHeightStep_m);
    expected.push_back({std::nearbyint(p.x / step) * step, std::nearbyint(p.y / step) * step, std::nearbyint(p.z / step) * step});
  }
  for (const Vec3& p : tile->glb.points) decoded.push_back(key(p));
  EXPECT_EQ(soup(expected, tile->mesh.triangles), soup(decoded, tile->glb.triangles));
  for (const double t : key(tile->glb.translation)) EXPECT_EQ(std::remainder(t, step), 0);
}

TEST(EncodeGlb, ExactAtTheFinestStepThatATileAllows) {
  for (int z = 0; z <= 18; z += 3) {
    const Lattice lattice{18};
    const TileAddress address{z, proto::tiles_across(z) * 5 / 8, proto::tiles_up(z) * 3 / 4};
    const auto tile = make_tile(address, hills(), 32, lattice);
    const double step = tile->input.ecef_steps.finest_m;
    for (const Vec3& p : tile->glb.points) {
      for (const double c : key(p)) ASSERT_EQ(std::remainder(c, step), 0) << "level " << z;
    }
    auto coarser = tile->input;
    coarser.ecef_steps = 4 * step;
    const auto again = decode_glb(encode_glb(coarser));
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->points.size(), tile->glb.points.size());
  }
}

TEST(EncodeGlb, TooFineAStepIsTheCallersMistake) {
  const TileMesh mesh = synthetic_mesh(kLattice, {3, 8, 5}, 8, hills());
  EncodeInput input = encode_input(kLattice, {3, 8, 5}, mesh);
  input.ecef_steps = std::ldexp(1, -10);
  EXPECT_THROW(encode_glb(input), std::invalid_argument);
}

TEST(EncodeGlb, SkirtsHangFromTheTilesSidesAloneAndFaceOutward) {
  const TileAddress address{9, 800, 300};
  const auto tile = make_tile(address, hills_with_voids(), 256);
  const DecodedGlb& glb = tile->glb;
  std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
  for (const Triangle& t : glb.triangles) {
    for (int c = 0; c < 3; ++c) directed.insert({t[c], t[(c + 1) % 3]});
  }
  const double side = std::numbers::pi / 512, west = -std::numbers::pi + 800 * side, south = -std::numbers::pi / 2 + 300 * side;
  const auto one_side = [&](std::uint32_t a, std::uint32_t b) {
    const Geodetic p = geodetic(glb.points[a]), q = geodetic(glb.points[b]);
    const auto both_at = [](double u, double v, double at) { return std::abs(u - at) < 1e-7 && std::abs(v - at) < 1e-7; };
    return both_at(p.longitude, q.longitude, west) || both_at(p.longitude, q.longitude, west + side) ||
           both_at(p.latitude, q.latitude, south) || both_at(p.latitude, q.latitude, south + side);
  };
  std::multiset<std::array<Key, 2>> sides, tops;
  std::size_t rims = 0;
  for (const auto& [a, b] : directed) {
    if (directed.contains({b, a})) continue;
    ++rims;
    if (one_side(a, b)) sides.insert({key(glb.points[a]), key(glb.points[b])});
  }
  std::set<Key> terrain;
  for (const Vec3& p : glb.points) terrain.insert(key(p));
  const auto at_top = [&](std::uint32_t v) { return terrain.contains(key(glb.skirt_points[v])); };
  for (const Triangle& t : glb.skirt_triangles) {
    for (int c = 0; c < 3; ++c) {
      // The strip runs against the rim, as a neighbour on its other side would: together they are one outward-facing surface.
      if (at_top(t[c]) && at_top(t[(c + 1) % 3]))
        tops.insert({key(glb.skirt_points[t[(c + 1) % 3]]), key(glb.skirt_points[t[c]])});
    }
  }
  EXPECT_GT(sides.size(), 500U);
  EXPECT_GT(rims, sides.size() + 500) << "the input has no holes: the test tests less";
  EXPECT_EQ(sides, tops);
  EXPECT_EQ(glb.skirt_triangles.size(), 2 * sides.size());
  for (std::uint32_t v = 0; v < glb.skirt_points.size(); ++v) {
    const double height = geodetic(glb.skirt_points[v]).height_m;
    EXPECT_TRUE(at_top(v) || height < 1800) << height;
  }
}

TEST(EncodeGlb, NormalsPointUpOnTheSea) {
  const auto sea = make_tile({9, 800, 300}, [](auto, auto) { return 0.0; });
  for (std::size_t v = 0; v < sea->glb.points.size(); ++v) {
    const Vec3 p = sea->glb.points[v];
    const Geodetic g = geodetic(p);
    const Vec3 up{std::cos(g.latitude) * std::cos(g.longitude), std::cos(g.latitude) * std::sin(g.longitude),
                  std::sin(g.latitude)};
    EXPECT_GT(dot(up, sea->glb.normals[v]), std::cos(0.005));
  }
}

// Across a side each tile knows only its own slope, along it both know the same: there the normals must not differ.
TEST(EncodeGlb, NormalsAgreeAlongTheCommonSide) {
  const auto a = make_tile({9, 800, 300}, hills(), 256), b = make_tile({9, 801, 300}, hills(), 256);
  std::map<Key, Vec3> of_a;
  for (std::size_t v = 0; v < a->glb.points.size(); ++v) of_a[key(a->glb.points[v])] = a->glb.normals[v];
  std::map<double, std::pair<Vec3, Vec3>> side;  // by z, northward: point and difference of normals
  for (std::size_t v = 0; v < b->glb.points.size(); ++v) {
    const Vec3 p = b->glb.points[v];
    const auto other = of_a.find(key(p));
    if (other == of_a.end()) continue;
    EXPECT_GT(dot(other->second, b->glb.normals[v]), std::cos(0.3));
    side[p.z] = {p, other->second - b->glb.normals[v]};
  }
  ASSERT_EQ(side.size(), 257U);
  for (auto at = std::next(side.begin()); std::next(at) != side.end(); ++at) {
    const Vec3 along = std::next(at)->second.first - std::prev(at)->second.first;
    EXPECT_NEAR(dot(along, at->second.second) / std::sqrt(dot(along, along)), 0, 0.01);
  }
}

TEST(EncodeRegion, GeodeticInvertsTheForwardFormula) {
  for (std::int64_t j = 0; j <= kLattice.rows(); j += 997) {
    for (const double height : {-500.0, 0.0, 8848.0}) {
      const Vec3 p = proto::ecef(proto::row_frames(kLattice, j, 1)[0], proto::column_frames(kLattice, 12345, 1)[0], height);
      const Geodetic g = geodetic(p);
      EXPECT_NEAR(g.height_m, height, 1e-4);
      EXPECT_NEAR(g.latitude, kLattice.latitude_deg(j) * std::numbers::pi / 180, 1e-11);
      EXPECT_NEAR(g.longitude, j % kLattice.rows() == 0 ? g.longitude : kLattice.longitude_deg(12345) * std::numbers::pi / 180,
                  1e-9);
    }
  }
}

// Slack for what a region cannot say: rounding may carry a point of the border over the antimeridian or a pole.
void expect_inside(const std::array<double, 6>& region, Vec3 p, double step) {
  const Geodetic g = geodetic(p);
  const double radius = std::hypot(p.x, p.y);
  const double slack = std::abs(std::abs(g.longitude) - std::numbers::pi) < 2 * step / std::max(radius, step) ? 7 : 1e-12;
  if (radius > 2 * step) {
    EXPECT_GE(g.longitude, region[0] - slack);
    EXPECT_LE(g.longitude, region[2] + slack);
  }
  EXPECT_GE(g.latitude, region[1] - 1e-12);
  EXPECT_LE(g.latitude, region[3] + 1e-12);
  EXPECT_GE(g.height_m, region[4] - 1e-6);
  EXPECT_LE(g.height_m, region[5] + 1e-6);
}

TEST(EncodeRegion, ContainsEveryDecodedTriangle) {
  const TileAddress places[] = {{0, 0, 0},  {0, 1, 0},  {1, 3, 1},   {2, 0, 0},      {3, 15, 7},
                                {4, 9, 12}, {5, 63, 0}, {6, 70, 50}, {9, 1023, 511}, {9, 700, 350}};
  for (const TileAddress& t : places) {
    for (const std::int32_t cells : {2, 16}) {
      SCOPED_TRACE(::testing::Message() << t.z << '/' << t.x << '/' << t.y << ", " << cells << " cells");
      const auto tile = make_tile(t, hills(), cells);
      const auto region = tile_region(tile->input);
      const auto check = [&](const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
        for (const Triangle& c : triangles) {
          const Vec3 p = points[c[0]], q = points[c[1]], r = points[c[2]];
          for (const double s : {0.0, 0.25, 1 / 3.0, 0.5, 1.0}) {
            for (const double w : {0.0, 0.25, 1 / 3.0, 0.5, 1.0}) {
              if (s + w <= 1) expect_inside(region, (1 - s - w) * p + (s * q + w * r), tile->input.ecef_steps.finest_m);
            }
          }
        }
      };
      check(tile->glb.points, tile->glb.triangles);
      check(tile->glb.skirt_points, tile->glb.skirt_triangles);
    }
  }
}

TEST(EncodeRegion, IsTightWhereTilesAreSmall) {
  const auto tile = make_tile(
      {9, 700, 350}, [](auto, auto) { return 100.0; }, 64);
  const auto region = tile_region(tile->input);
  const double side = std::numbers::pi / 512;
  EXPECT_NEAR(region[0], -std::numbers::pi + 700 * side, 1e-8);
  EXPECT_NEAR(region[1], -std::numbers::pi / 2 + 350 * side, 1e-8);
  EXPECT_NEAR(region[3], -std::numbers::pi / 2 + 351 * side, 1e-7);
  EXPECT_NEAR(region[4], 60, 0.2);
  EXPECT_NEAR(region[5], 100, 0.02);
}

TEST(Decode, DamagedBytesAreAProblem) {
  const TileMesh mesh = synthetic_mesh(kLattice, {8, 411, 170}, 8, hills());
  const EncodeInput input = encode_input(kLattice, {8, 411, 170}, mesh);
  const std::string drc = encode_drc(input), glb = encode_glb(input);
  for (std::size_t size = 0; size < drc.size(); size += 7) EXPECT_FALSE(decode_drc(drc.substr(0, size)).ok()) << size;
  for (std::size_t size = 0; size < glb.size(); size += 7) EXPECT_FALSE(decode_glb(glb.substr(0, size)).ok()) << size;
  EXPECT_FALSE(decode_glb(drc).ok());
  EXPECT_FALSE(decode_drc(glb).ok());
}

}  // namespace
}  // namespace cordillera::pipeline
