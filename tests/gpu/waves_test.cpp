// The simplifier as a whole: laws, and the hashes that a real GPU gave.
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "gpu/grid_mesh_sparse.h"
#include "tests/bench/pyramid/pyramid.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera {
namespace {

// Recorded on 2026-11-21 on one NVIDIA H200 (CUDA 13.0, sm_90) by `pyramid_bench cuda 4 4`, level 12 (the hash of a level depends on all
// levels below it). A machine without a GPU checks its CPU against them; change them only with a run on a device.
const std::map<std::string, std::uint64_t> kDeviceHashes{
    {"alpine", 0x6a794e7da371993a}, {"rolling", 0x88281ad0695d514c}, {"city", 0xc5486e5a19b884d3},
    {"islands", 0x3270c3a4211d34d4}, {"noise", 0xe4e3e1cef676653f}, {"plane", 0x09b33c83936a6fe2},
};

// The same of `pyramid_bench cuda 4 4 --sparse 0.25`, on 2026-11-22 on another of them.
constexpr float kStartShare = 0.25f;
const std::map<std::string, std::uint64_t> kSparseDeviceHashes{
    {"alpine", 0x8c249acc56ba3937}, {"rolling", 0x2a9e98254a2374e8}, {"city", 0xc7939d790d4851b1},
    {"islands", 0xbc807786e8947eeb}, {"noise", 0x68cf09ade459caef}, {"plane", 0xe15ccff73dbf4202},
};

class Waves : public testing::TestWithParam<int> {};

TEST_P(Waves, CpuGivesTheBitsOfTheDevice) {
  const auto cpu = gpu::make_simplifier("cpu");
  ASSERT_TRUE(cpu.ok());
  const auto levels = bench::run_pyramid(static_cast<bench::Terrain>(GetParam()), 4, 4, **cpu);
  ASSERT_EQ(levels.size(), 3u);
  EXPECT_EQ(levels.back().hash, kDeviceHashes.at(std::string(bench::kTerrainNames[GetParam()])));
}

TEST_P(Waves, CpuGivesTheBitsOfTheDeviceFromASparseStart) {
  const auto cpu = gpu::make_simplifier("cpu");
  ASSERT_TRUE(cpu.ok());
  bench::PyramidRun run;
  run.start_share = kStartShare;
  const auto levels = bench::run_pyramid(static_cast<bench::Terrain>(GetParam()), 4, 4, **cpu, run);
  EXPECT_EQ(levels.back().hash, kSparseDeviceHashes.at(std::string(bench::kTerrainNames[GetParam()])));
}

TEST_P(Waves, CudaGivesTheBitsOfTheCpu) {
  const auto cuda = gpu::make_simplifier("cuda");
  if (!cuda.ok()) GTEST_SKIP() << "no CUDA device: " << cuda.problem().detail;
  const auto cpu = gpu::make_simplifier("cpu");
  const auto on_cpu = bench::run_pyramid(static_cast<bench::Terrain>(GetParam()), 2, 4, **cpu);
  const auto on_cuda = bench::run_pyramid(static_cast<bench::Terrain>(GetParam()), 2, 4, **cuda);
  for (std::size_t k = 0; k < on_cpu.size(); ++k) EXPECT_EQ(on_cpu[k].hash, on_cuda[k].hash);
}

INSTANTIATE_TEST_SUITE_P(Terrains, Waves, testing::Range(0, 6), [](const auto& terrain) { return std::string(bench::kTerrainNames[terrain.param]); });

TEST(Waves, GridHasSixTrianglesAtEveryInnerVertex) {
  const std::vector<std::int32_t> heights(17 * 17, 0);
  const proto::TileMesh mesh = gpu::grid_mesh(16, 1, heights);
  const auto neighbours = test::neighbours(mesh);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    if (mesh.x[v] % 16 && mesh.y[v] % 16) {
      EXPECT_EQ(neighbours[v].size(), 6u);
    }
  }
  EXPECT_EQ(mesh.triangles.size(), 2u * 16 * 16);
}

TEST(Waves, ResultsDoNotDependOnTheBatch) {
  std::vector<proto::TileMesh> inputs;
  std::vector<std::vector<float>> elevations;
  for (int t = 0; t < 3; ++t) {
    std::vector<std::int32_t> heights;
    for (int y = 0; y <= 64; ++y) {
      for (int x = 0; x <= 64; ++x) heights.push_back(bench::terrain_height(bench::Terrain::islands, x + 100 * t, y));
    }
    inputs.push_back(gpu::grid_mesh(64, 1, heights));
    elevations.emplace_back();
    for (const std::int32_t h : inputs.back().height) elevations.back().push_back(static_cast<float>(h) / 1024);
  }
  const auto cpu = gpu::make_simplifier("cpu");
  std::vector<gpu::SimplifyJob> jobs;
  for (std::size_t t = 0; t < 3; ++t) jobs.push_back({&inputs[t], elevations[t], 1, 5, 5, 1});
  const auto together = (*cpu)->simplify(jobs);
  for (std::size_t t = 0; t < 3; ++t) {
    const auto alone = (*cpu)->simplify({&jobs[t], 1});
    EXPECT_EQ(alone.front().triangles, together[t].triangles);
    EXPECT_EQ(alone.front().x, together[t].x);
    EXPECT_EQ(test::broken_law(together[t]), "");
    EXPECT_LT(together[t].vertices(), inputs[t].vertices());
  }
}

/// A grid of `cells`, with marks as a chain and a caller may have set them.
proto::TileMesh marked_grid(bench::Terrain kind, std::int32_t cells) {
  std::vector<std::int32_t> heights;
  for (std::int32_t y = 0; y <= cells; ++y) {
    for (std::int32_t x = 0; x <= cells; ++x) heights.push_back(bench::terrain_height(kind, 3 * x + 900, 3 * y + 700));
  }
  proto::TileMesh mesh = gpu::grid_mesh(cells, 1, heights);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const bool side = mesh.x[v] % cells == 0 || mesh.y[v] % cells == 0, corner = mesh.x[v] % cells == 0 && mesh.y[v] % cells == 0;
    if (side && !corner) mesh.mark[v] |= (mesh.x[v] + mesh.y[v]) % 8 == 0 || (mesh.mark[v] & proto::kVoid) ? proto::kKeep : proto::kRemove;
    if (v % 97 == 5) mesh.mark[v] |= proto::kKeep;
  }
  return mesh;
}
std::vector<float> metres(const proto::TileMesh& mesh) {
  std::vector<float> elevation;
  for (const std::int32_t h : mesh.height) elevation.push_back(static_cast<float>(h * proto::kHeightStep_m));
  return elevation;
}
void expect_same(const proto::TileMesh& a, const proto::TileMesh& b) {
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.mark, b.mark);
  EXPECT_EQ(a.triangles, b.triangles);
}

// The rings of a start are found without triangles: they must be those of the triangles that sparse_grid() makes.
TEST(Waves, ASparseStartIsTheSparseGrid) {
  const auto cpu = gpu::make_simplifier("cpu");
  for (const auto kind : {bench::Terrain::alpine, bench::Terrain::islands, bench::Terrain::plane, bench::Terrain::city}) {
    for (const std::int32_t cells : {1, 2, 8, 64}) {
      for (const float tolerance_m : {0.25f, 40.0f}) {
        const proto::TileMesh grid = marked_grid(kind, cells);
        const std::vector<float> elevation = metres(grid);
        const gpu::SparseGrid start = gpu::sparse_grid(grid, elevation, tolerance_m);
        gpu::SimplifyJob dense{&grid, elevation, 1, 8 * tolerance_m, 8 * tolerance_m, 1};
        const gpu::SimplifyJob sparse{&start.mesh, start.elevation, 1, 8 * tolerance_m, 8 * tolerance_m, 1};
        dense.start_tolerance_m = tolerance_m;
        SCOPED_TRACE(std::string(bench::kTerrainNames[static_cast<std::size_t>(kind)]) + " " + std::to_string(cells));
        expect_same((*cpu)->simplify({&dense, 1}).front(), (*cpu)->simplify({&sparse, 1}).front());
      }
    }
  }
}

// Grids that start sparse, grids that do not and meshes that are no grids share a batch where a device takes many at once.
TEST(Waves, SparseStartsDoNotDependOnTheBatch) {
  std::vector<proto::TileMesh> inputs;
  for (const std::int32_t cells : {32, 64, 8, 64, 16}) inputs.push_back(marked_grid(bench::Terrain::islands, cells));
  std::vector<std::vector<float>> elevations;
  for (const auto& input : inputs) elevations.push_back(metres(input));
  gpu::SparseGrid start = gpu::sparse_grid(inputs[3], elevations[3], 1);
  inputs[3] = std::move(start.mesh);
  elevations[3] = std::move(start.elevation);
  std::vector<gpu::SimplifyJob> jobs;
  for (std::size_t t = 0; t < inputs.size(); ++t) {
    jobs.push_back({&inputs[t], elevations[t], 1, 5, 5, 1});
    jobs.back().start_tolerance_m = t == 1 || t == 3 ? 0.0f : 1.0f;
  }
  const auto cpu = gpu::make_simplifier("cpu");
  for (const char* device : {"cpu", "cuda"}) {
    const auto simplifier = gpu::make_simplifier(device);
    if (!simplifier.ok()) continue;  // no GPU
    const auto together = (*simplifier)->simplify(jobs);
    for (std::size_t t = 0; t < jobs.size(); ++t) {
      SCOPED_TRACE(device + std::to_string(t));
      expect_same(together[t], (*cpu)->simplify({&jobs[t], 1}).front());
    }
  }
}

TEST(Waves, ASparseStartAsksForAGrid) {
  proto::TileMesh grid = marked_grid(bench::Terrain::plane, 6);
  const std::vector<float> elevation = metres(grid);
  gpu::SimplifyJob job{&grid, elevation, 1, 5, 5, 1};
  job.start_tolerance_m = 1;
  const auto cpu = gpu::make_simplifier("cpu");
  EXPECT_THROW((*cpu)->simplify({&job, 1}), std::invalid_argument);
}

TEST(Waves, UnknownDevicesAreNamed) {
  for (const char* device : {"gpu", "cuda:x", "cuda:-1", "cuda:"}) {
    const auto simplifier = gpu::make_simplifier(device);
    ASSERT_FALSE(simplifier.ok()) << device;
    EXPECT_NE(simplifier.problem().detail.find(device), std::string::npos);
  }
}

}  // namespace
}  // namespace cordillera
