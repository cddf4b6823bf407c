// Tiles of half the earth: each is the other's neighbour on both sides, and hills at their common side are in view from the other
// half.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "pipeline/faces/quantized_mesh/mesh_grid.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bounds.h"
#include "tests/pipeline/quantized_mesh_dataset.h"
#include "tests/pipeline/quantized_mesh_decoder.h"
#include "tests/pipeline/terrain_made.h"

namespace cordillera::pipeline {
namespace {

using proto::Vec3;
using namespace testing;

DecodedTerrain tile_of(const faces::Terrain& terrain, const char* path) {
  const auto document = fetch(terrain, path);
  EXPECT_TRUE(document) << path;
  return TerrainReader(document->bytes).read();
}

TEST(QuantizedHemisphere, NormalsAreTheSameWhereTheTwoMeet) {
  const Made made({{{7, 126, 80}, {7, 129, 83}}}, hills());  // about longitude 0
  const DecodedTerrain west = tile_of(made.terrain(), "terrain/0/0/0.terrain"),
                       east = tile_of(made.terrain(), "terrain/0/1/0.terrain");
  std::map<std::pair<int, double>, Vec3> normals;
  for (const std::uint32_t v : west.sides[2]) normals[{west.vertices[v][1], west.height_m(v)}] = west.normals[v];
  std::size_t data = 0;
  for (const std::uint32_t v : east.sides[0]) {
    const auto same = normals.find({east.vertices[v][1], east.height_m(v)});
    if (same == normals.end()) continue;
    EXPECT_GT(dot(same->second, east.normals[v]), 0.99999) << east.vertices[v][1];
    data += east.height_m(v) != 0 ? 1 : 0;
  }
  EXPECT_GT(data, 2u);
}

TEST(QuantizedHemisphere, AHillAtItsSideIsNeverBehindTheHorizon) {
  faces::QuantizedSurface surface;
  surface.angles = faces::geodetic_angles({0, 1, 0});
  surface.step_m = 1;
  for (const auto& [u, v] : {std::pair{0, 0}, {32767, 0}, {32767, 32767}, {0, 32767}}) surface.vertices.push_back({u, v, 0, {}});
  EXPECT_TRUE(std::isnan(faces::quantized_bounds(surface, faces::positions(surface)).horizon.y)) << "no point is far enough";
  surface.vertices.push_back({2, 24000, 1900, {}});  // seen from a kilometre above ground two degrees to the west
  EXPECT_TRUE(std::isnan(faces::quantized_bounds(surface, faces::positions(surface)).horizon.y));
  surface.angles = faces::geodetic_angles({1, 2, 1});  // an eighth of the earth has one
  const Vec3 point = faces::quantized_bounds(surface, faces::positions(surface)).horizon;
  EXPECT_GT(dot(point, point), 1);
}

}  // namespace
}  // namespace cordillera::pipeline
