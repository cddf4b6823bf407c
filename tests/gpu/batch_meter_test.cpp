// What a device finds of many tiles' triangles against surface_error() alone, tile by tile: every number, to the last bit.
#include "gpu/measure/batch_meter.h"

#include <gtest/gtest.h>

#include <random>

#include "gpu/cleap/tile_simplifier.h"
#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/mesh/tile_valence.h"
#include "gpu/simplify.h"
#include "tests/bench/terrain.h"
#include "tests/gpu/grid_mesh.h"

namespace cordillera::gpu {
namespace {

using proto::TileAddress;
using proto::TileMesh;

constexpr proto::Lattice kLattice{14};
const EcefSteps kSteps{1.0 / 4096, 1.0 / 256, 20, 9};  // vertices are near and far

/// Tiles over one raster, simplified, some vertices moved up or down.
struct Scene {
  proto::Samples samples;
  std::vector<TileAddress> addresses;
  std::vector<TileMesh> meshes;

  std::vector<SurfaceErrorInput> tiles() const {
    std::vector<SurfaceErrorInput> tiles;
    for (std::size_t t = 0; t < meshes.size(); ++t) tiles.push_back({&kLattice, addresses[t], &meshes[t], &samples, kSteps});
    return tiles;
  }
};

/// All tiles of level z under the tile `top`; the mesh of a tile has `cells` cells a side before it is simplified. missing: rows
/// and columns of samples that are not there, at each side of the raster.
Scene scene(bench::Terrain kind, TileAddress top, int z, std::int32_t cells, std::int64_t missing = 0) {
  Scene s;
  const std::int64_t west = kLattice.west(top), south = kLattice.south(top), side = kLattice.tile_units(top.z);
  const auto across = static_cast<std::int32_t>(side + 1 - 2 * missing);
  s.samples = {west + missing, south + missing, across, across, {}, {}};
  for (std::int64_t y = missing; y <= side - missing; ++y)
    for (std::int64_t x = missing; x <= side - missing; ++x) s.samples.height.push_back(bench::terrain_height(kind, x, y));
  cleap::offer_strategies();
  const auto simplifier = make_simplifier("cpu", one_after_the_other, "cleap");
  std::mt19937 random(7);
  const int down = z - top.z;
  for (int k = 0; k < 1 << 2 * down; ++k) {
    const TileAddress tile{z, (top.x << down) + (k & ((1 << down) - 1)), (top.y << down) + (k >> down)};
    const auto step = static_cast<std::int32_t>(kLattice.tile_units(z) / cells);
    std::vector<std::int32_t> heights;
    for (std::int32_t y = 0; y <= cells; ++y) {
      for (std::int32_t x = 0; x <= cells; ++x) {
        const std::int64_t i = kLattice.west(tile) + std::int64_t{x} * step - s.samples.west,
                           j = kLattice.south(tile) + std::int64_t{y} * step - s.samples.south;
        const bool there = i >= 0 && j >= 0 && i < across && j < across;
        heights.push_back(there ? s.samples.height[static_cast<std::size_t>(j * across + i)] : proto::kNoHeight);
      }
    }
    TileMesh grid = grid_mesh(cells, step, heights);
    for (std::uint32_t v = 0; v < grid.vertices(); ++v)
      if (sides_of(grid, v) > 0) grid.mark[v] |= proto::kKeep;
    std::vector<float> elevation;
    for (const std::int32_t h : grid.height) elevation.push_back(static_cast<float>(h) / 1024);
    const SimplifyJob job{&grid, elevation, 4, static_cast<float>(step), 1};
    TileMesh mesh = (*simplifier)->simplify({&job, 1}).front();
    for (std::int32_t& h : mesh.height) h += static_cast<std::int32_t>(random() % 5) * 300;
    s.addresses.push_back(tile);
    s.meshes.push_back(std::move(mesh));
  }
  return s;
}

std::unique_ptr<BatchMeter> meter_of(const std::string& device) {
  if (device == "cpu") return make_host_batch_meter();
  auto made = make_batch_meter(device);
  return made.ok() ? std::move(*made) : nullptr;
}

/// What is found: samples that have no triangle over them or should have none, in all tiles; triangles, and those of them that
/// the meter left to the host.
struct Found {
  std::uint64_t odd = 0;
  std::size_t triangles = 0, left = 0;
};

Found expect_same(const std::string& device, const Scene& s, double limit_m = INFINITY) {
  const auto meter = meter_of(device);
  Found all;
  for (int again = 0; again < 2; ++again) {
    const std::vector<SurfaceErrorInput> tiles = s.tiles();
    std::vector<SurfaceMemory> memories(tiles.size());
    meter->measure(tiles, limit_m, memories);
    for (std::size_t t = 0; t < tiles.size(); ++t) {
      for (const SurfaceMemory::Triangle& triangle : memories[t].triangles) all.left += triangle.floor_m == INFINITY ? 1 : 0;
      all.triangles += memories[t].triangles.size();
      const SurfaceError truth = surface_error(tiles[t], limit_m), found = surface_error(tiles[t], limit_m, memories[t]);
      EXPECT_GT(truth.samples, tiles[t].mesh->vertices());
      EXPECT_GT(truth.max_m, 0.1);
      EXPECT_EQ(found.max_m, truth.max_m) << "tile " << t;
      EXPECT_EQ(found.sum_squared_m2, truth.sum_squared_m2) << "tile " << t;
      EXPECT_EQ(found.samples, truth.samples) << "tile " << t;
      EXPECT_EQ(found.uncovered, truth.uncovered) << "tile " << t;
      EXPECT_EQ(found.overcovered, truth.overcovered) << "tile " << t;
      EXPECT_EQ(triangles_over(found), triangles_over(truth)) << "tile " << t;
      all.odd += truth.uncovered + truth.overcovered;
    }
  }
  return all;
}

/// Most triangles are void or measured by the meter.
void expect_few_left(const Found& found) { EXPECT_LT(found.left * 10, found.triangles); }

class BatchMeterOnDevice : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!meter_of(GetParam())) GTEST_SKIP() << make_batch_meter(GetParam()).problem().detail;
  }
};

TEST_P(BatchMeterOnDevice, FinestTiles) {
  expect_few_left(expect_same(GetParam(), scene(bench::Terrain::alpine, {13, 15000, 6000}, 14, 256)));
}
TEST_P(BatchMeterOnDevice, HolesAndTheirRims) {
  EXPECT_GT(expect_same(GetParam(), scene(bench::Terrain::islands, {13, 15000, 6000}, 14, 256)).odd, 0u);
}
TEST_P(BatchMeterOnDevice, LargeTriangles) {
  expect_few_left(expect_same(GetParam(), scene(bench::Terrain::rolling, {12, 7500, 2900}, 12, 8)));
}
TEST_P(BatchMeterOnDevice, TheLargestAreLeftToTheHost) {
  const Found found = expect_same(GetParam(), scene(bench::Terrain::plane, {12, 7500, 2900}, 12, 2));
  EXPECT_EQ(found.left, found.triangles);
}
TEST_P(BatchMeterOnDevice, ThoseOverTheLimitAreLeftToTheHost) {
  const Found found = expect_same(GetParam(), scene(bench::Terrain::alpine, {13, 15000, 6000}, 14, 256), 2);
  EXPECT_GT(found.left, 100u);
  EXPECT_LT(found.left, found.triangles);
}
TEST_P(BatchMeterOnDevice, SamplesThatEndInsideTheTile) {
  expect_same(GetParam(), scene(bench::Terrain::alpine, {13, 15000, 6000}, 14, 64, 40));
}
TEST_P(BatchMeterOnDevice, TrianglesSeenBeyondTheirEdgesAtThePole) {
  expect_same(GetParam(), scene(bench::Terrain::alpine, {13, (1 << 14) - 1, (1 << 13) - 1}, 13, 32));
}
TEST_P(BatchMeterOnDevice, TrianglesBeyondTheSamplesAreLeftToTheHost) {
  Scene s = scene(bench::Terrain::alpine, {13, 15000, 6000}, 14, 64);
  s.samples.rows -= 100;
  s.samples.height.resize(static_cast<std::size_t>(s.samples.rows) * static_cast<std::size_t>(s.samples.columns));
  EXPECT_GT(expect_same(GetParam(), s).left, 100u);
}

INSTANTIATE_TEST_SUITE_P(Devices, BatchMeterOnDevice, testing::Values("cpu", "cuda"));

TEST(BatchMeter, WhatIsNoGpuIsNamed) {
  EXPECT_EQ(make_batch_meter("abacus").problem().type, "unknown-device");
  EXPECT_EQ(make_batch_meter("cpu").problem().type, "device-unavailable");
}

}  // namespace
}  // namespace cordillera::gpu
