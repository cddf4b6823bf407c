// Draco meshes in WebMercatorQuad against the meshes they are cut from.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/json.h"
#include "tests/pipeline/drc_point.h"
#include "tests/pipeline/quantized_mesh_dataset.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;

/// z, x, y as the path has them: y from the north.
using Address = std::array<int, 3>;

const std::map<Address, DecodedDrc>& all_tiles() {
  static const auto tiles = [] {
    std::map<Address, DecodedDrc> out;
    const faces::Face* face = faces::face_named("drc-mercator");
    face->each_path(terrain(), [&](const std::string& path) {
      if (path.ends_with(".json")) return;
      const auto found = faces::find(path);
      out.emplace(Address{found->place.z, found->place.x, found->place.y}, decode_drc(fetch(path)->bytes).value());
    });
    return out;
  }();
  return tiles;
}

/// Latitude of a parallel between rows of tiles, y from the north, parts of rows too.
double latitude_deg(int z, double y) {
  return std::atan(std::sinh(std::numbers::pi * (1 - 2 * y / std::ldexp(1, z)))) * 180 / std::numbers::pi;
}

struct Place {
  double longitude = 0, latitude = 0, height_m = 0;
};
/// The formula of the TileJSON, written down once more.
Place place(const DecodedDrc& tile, std::size_t vertex) {
  const auto& [u, v, h] = tile.points[vertex];
  return {(tile.x + double(u) / tile.side) * 360 / std::ldexp(1, tile.z) - 180,
          latitude_deg(tile.z, tile.y + 1 - double(v) / tile.side), h * tile.height_step};
}

TEST(MercatorDraco, SaysWhereItIs) {
  const Json json = Json::parse(fetch("web-mercator.json")->bytes);
  EXPECT_EQ(json["tileMatrixSetId"], "WebMercatorQuad");
  EXPECT_EQ(json["tiles"], Json::array({"web-mercator/tiles/{z}/{x}/{y}.drc"}));
  EXPECT_EQ(json["minzoom"], 3);
  EXPECT_EQ(json["maxzoom"], kFinest + 1);
  EXPECT_EQ(json["attribution"], "Nobody &lt;nobody@example.org&gt;");
  EXPECT_EQ(json["zooms"].size(), kFinest - 1U);
  EXPECT_EQ(json["zooms"][0]["level"], 2);
  ASSERT_GT(all_tiles().size(), 60U);
  for (const auto& [at, tile] : all_tiles()) {
    EXPECT_TRUE(tile.web_mercator);
    EXPECT_EQ(at, (Address{tile.z, tile.x, tile.y}));
    for (const auto& [u, v, h] : tile.points) EXPECT_TRUE(u >= 0 && u <= tile.side && v >= 0 && v <= tile.side);
    const DrcPoint point = drc_point(tile, 0);
    EXPECT_NEAR(point.latitude_deg, place(tile, 0).latitude, 1e-12);
    EXPECT_NEAR(point.longitude_deg, place(tile, 0).longitude, 1e-12);
  }
  EXPECT_FALSE(fetch("web-mercator/tiles/8/0/0.drc"));
  EXPECT_FALSE(fetch("web-mercator/tiles/2/2/1.drc")) << "level 1 is not published";
}

TEST(MercatorDraco, LiesOnTheSurface) {
  std::size_t checked = 0, cuts = 0;
  for (const auto& [at, tile] : all_tiles()) {
    const double unit_m = 40075017 / std::ldexp(1, tile.z) / tile.side;
    for (std::size_t k = 0; k < tile.points.size(); ++k) {
      const Place p = place(tile, k);
      const auto height_m = terrain().height_m(tile.z - 1, p.longitude, p.latitude);
      if (!height_m) continue;  // a rim that was rounded outward
      // Half a unit of place on slopes below 2, and half a step.
      EXPECT_NEAR(p.height_m, *height_m, unit_m + 0.001)
          << tile.z << " " << tile.x << " " << tile.y << " " << p.longitude << " " << p.latitude;
      ++checked;
      cuts += tile.points[k][1] == 0 || tile.points[k][1] == tile.side ? 1 : 0;
    }
  }
  EXPECT_GT(checked, 4000U);
  EXPECT_GT(cuts, 500U);
}

/// Edges on a side, u or v of both ends and both heights. across: which of u and v is the side's.
std::set<std::array<int, 4>> edges_on(const DecodedDrc& tile, std::size_t across, int at) {
  std::set<std::array<int, 4>> out;
  for (const auto& t : tile.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      auto a = tile.points[t[k]], b = tile.points[t[(k + 1) % 3]];
      if (a[across] != at || b[across] != at) continue;
      if (a[1 - across] > b[1 - across]) std::swap(a, b);
      out.insert({a[1 - across], b[1 - across], a[2], b[2]});
    }
  }
  return out;
}

TEST(MercatorDraco, NeighboursShareTheirEdges) {
  std::size_t parallels = 0, meridians = 0;
  for (const auto& [at, tile] : all_tiles()) {
    if (const auto south = all_tiles().find({at[0], at[1], at[2] + 1}); south != all_tiles().end()) {
      const auto mine = edges_on(tile, 1, 0);
      EXPECT_EQ(mine, edges_on(south->second, 1, south->second.side)) << at[0] << " " << at[1] << " " << at[2];
      parallels += mine.size();
    }
    if (const auto east = all_tiles().find({at[0], at[1] + 1, at[2]}); east != all_tiles().end()) {
      const auto mine = edges_on(tile, 0, tile.side), theirs = edges_on(east->second, 0, 0);
      // Where both have data; a hole may end at the side.
      for (const auto& edge : mine) {
        for (const auto& other : theirs) {
          if (edge[0] < other[1] && other[0] < edge[1]) {
            EXPECT_EQ(edge, other);
            ++meridians;
          }
        }
      }
    }
  }
  EXPECT_GT(parallels, 300U);
  EXPECT_GT(meridians, 80U);
}

/// Square degrees.
double area(const std::array<Place, 3>& p) {
  return ((p[1].longitude - p[0].longitude) * (p[2].latitude - p[0].latitude) -
          (p[1].latitude - p[0].latitude) * (p[2].longitude - p[0].longitude)) /
         2;
}

TEST(MercatorDraco, CoversWhatTheLevelCovers) {
  std::map<int, double> mercator, geodetic;
  for (const auto& [at, tile] : all_tiles()) {
    for (const auto& t : tile.triangles) mercator[tile.z] += area({place(tile, t[0]), place(tile, t[1]), place(tile, t[2])});
  }
  const faces::Face* face = faces::face_named("drc");
  face->each_path(terrain(), [&](const std::string& path) {
    const DecodedDrc tile = decode_drc(fetch(path)->bytes).value();
    const auto at = [&](std::size_t vertex) {
      const DrcPoint p = drc_point(tile, vertex);
      return Place{p.longitude_deg, p.latitude_deg, p.height_m};
    };
    for (const auto& t : tile.triangles) geodetic[tile.z + 1] += area({at(t[0]), at(t[1]), at(t[2])});
  });
  ASSERT_EQ(mercator.size(), geodetic.size());
  // What is straight on the map is not in degrees: along a rim that is some square kilometres in all.
  for (const auto& [zoom, sum] : geodetic) EXPECT_NEAR(mercator[zoom] / sum, 1, 1e-4) << zoom;
}

}  // namespace
}  // namespace cordillera::pipeline
