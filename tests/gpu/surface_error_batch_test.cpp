// The errors of many tiles on a device against surface_error(), tile by tile: every number, to the last bit.
#include "tests/bench/batch_meter/surface_error_batch.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/bench/pyramid/terrain.h"

namespace cordillera::gpu {
namespace {

using proto::TileAddress;
using proto::TileMesh;

constexpr proto::Lattice kLattice{14};
constexpr double kStep_m = 1.0 / 256;

/// Tiles over one raster, simplified, some vertices moved up or down.
struct Scene {
  proto::Samples samples;
  std::vector<TileAddress> addresses;
  std::vector<TileMesh> meshes;

  SurfaceErrorInput input(std::size_t t) const { return {&kLattice, addresses[t], &meshes[t], &samples, kStep_m}; }
  std::vector<TileSurface> tiles() const {
    std::vector<TileSurface> tiles;
    for (std::size_t t = 0; t < meshes.size(); ++t) tiles.push_back({addresses[t], &meshes[t]});
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
  const auto simplifier = make_simplifier("cpu");
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
    const TileMesh grid = grid_mesh(cells, step, heights);
    std::vector<float> elevation;
    for (const std::int32_t h : grid.height) elevation.push_back(static_cast<float>(h) / 1024);
    const auto cell = static_cast<float>(step);
    const SimplifyJob job{&grid, elevation, cell, 4, 4, cell};
    TileMesh mesh = (*simplifier)->simplify({&job, 1}).front();
    for (std::int32_t& h : mesh.height) h += static_cast<std::int32_t>(random() % 5) * 300;
    s.addresses.push_back(tile);
    s.meshes.push_back(std::move(mesh));
  }
  return s;
}

/// Returns the samples that have no triangle over them or should have none, in all tiles.
std::uint64_t expect_same(const std::string& device, const Scene& s) {
  const auto meter = make_batch_meter(device);
  std::uint64_t odd = 0;
  (*meter)->keep(kLattice, s.samples, kStep_m);
  for (int again = 0; again < 2; ++again) {
    const std::vector<SurfaceError> found = (*meter)->measure(s.tiles());
    EXPECT_EQ(found.size(), s.meshes.size());
    for (std::size_t t = 0; t < found.size(); ++t) {
      const SurfaceError truth = surface_error(s.input(t), INFINITY);
      EXPECT_GT(truth.samples, 0u);
      EXPECT_GT(truth.max_m, 0.1);
      EXPECT_EQ(found[t].max_m, truth.max_m) << "tile " << t;
      EXPECT_EQ(found[t].sum_squared_m2, truth.sum_squared_m2) << "tile " << t;
      EXPECT_EQ(found[t].samples, truth.samples) << "tile " << t;
      EXPECT_EQ(found[t].uncovered, truth.uncovered) << "tile " << t;
      EXPECT_EQ(found[t].overcovered, truth.overcovered) << "tile " << t;
      odd += truth.uncovered + truth.overcovered;
    }
  }
  return odd;
}

class BatchMeterOnDevice : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const auto meter = make_batch_meter(GetParam());
    if (!meter.ok()) GTEST_SKIP() << meter.problem().detail;
  }
};

TEST_P(BatchMeterOnDevice, FinestTiles) { expect_same(GetParam(), scene(bench::Terrain::alpine, {13, 17000, 12000}, 14, 256)); }
TEST_P(BatchMeterOnDevice, HolesAndTheirRims) {
  EXPECT_GT(expect_same(GetParam(), scene(bench::Terrain::islands, {13, 17000, 12000}, 14, 256)), 0u);
}
TEST_P(BatchMeterOnDevice, LargeTriangles) { expect_same(GetParam(), scene(bench::Terrain::rolling, {12, 8500, 7900}, 12, 8)); }
TEST_P(BatchMeterOnDevice, SamplesThatEndInsideTheTile) {
  expect_same(GetParam(), scene(bench::Terrain::alpine, {13, 17000, 12000}, 14, 64, 40));
}
TEST_P(BatchMeterOnDevice, TrianglesSeenBeyondTheirEdgesAtThePole) {
  expect_same(GetParam(), scene(bench::Terrain::alpine, {13, (1 << 14) - 1, (1 << 13) - 1}, 13, 32));
}
TEST_P(BatchMeterOnDevice, VerticesOutsideTheSamplesAreMeasuredOnTheHost) {
  Scene s = scene(bench::Terrain::alpine, {13, 17000, 12000}, 14, 64);
  s.samples.rows -= 100;
  s.samples.height.resize(static_cast<std::size_t>(s.samples.rows) * static_cast<std::size_t>(s.samples.columns));
  expect_same(GetParam(), s);
}

INSTANTIATE_TEST_SUITE_P(Devices, BatchMeterOnDevice, testing::Values("cpu", "cuda"));

TEST(BatchMeter, UnknownDeviceIsNamed) { EXPECT_EQ(make_batch_meter("abacus").problem().type, "unknown-device"); }

}  // namespace
}  // namespace cordillera::gpu
