// The simplifier as a whole: laws, and the hashes that a real GPU gave.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/bench/pyramid/pyramid.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera {
namespace {

// Recorded on 2026-11-22 on one NVIDIA H200 (CUDA 13.0, sm_90) by `pyramid_bench cuda 4 4`, level 12 (the hash of a level depends
// on all levels below it). A machine without a GPU checks its CPU against them; change them only with a run on a device.
const std::map<std::string, std::uint64_t> kDeviceHashes{
    {"alpine", 0xdc30df36de38602a},  {"rolling", 0x407ee90d63eb588a}, {"city", 0x6331c08660ad50a6},
    {"islands", 0x4d527f366414af9b}, {"noise", 0xd72104d75985e673},   {"plane", 0xe15ccff73dbf4202},
};

// The same of `pyramid_bench cuda 4 4 --sparse 0.5`.
constexpr float kStartShare = 0.5f;
const std::map<std::string, std::uint64_t> kSparseDeviceHashes{
    {"alpine", 0x96009d196dded2dc},  {"rolling", 0xcc91e2f21206451e}, {"city", 0x59d3ac6d695fa31c},
    {"islands", 0x2ab6ab90d19e6bb6}, {"noise", 0xfea8bb07481eb3d4},   {"plane", 0xe15ccff73dbf4202},
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
  ASSERT_EQ(levels.size(), 3u);
  EXPECT_EQ(levels.back().hash, kSparseDeviceHashes.at(std::string(bench::kTerrainNames[GetParam()])));
}

TEST_P(Waves, CudaGivesTheBitsOfTheCpu) {
  const auto cuda = gpu::make_simplifier("cuda");
  if (!cuda.ok()) GTEST_SKIP() << "no CUDA device: " << cuda.problem().detail;
  const auto cpu = gpu::make_simplifier("cpu");
  const auto on_cpu = bench::run_pyramid(static_cast<bench::Terrain>(GetParam()), 2, 4, **cpu);
  const auto on_cuda = bench::run_pyramid(static_cast<bench::Terrain>(GetParam()), 2, 4, **cuda);
  ASSERT_EQ(on_cpu.size(), 2u);
  ASSERT_EQ(on_cuda.size(), 2u);
  for (std::size_t k = 0; k < on_cpu.size(); ++k) EXPECT_EQ(on_cpu[k].hash, on_cuda[k].hash);
}

INSTANTIATE_TEST_SUITE_P(Terrains, Waves, testing::Range(0, 6),
                         [](const auto& terrain) { return std::string(bench::kTerrainNames[terrain.param]); });

TEST(Waves, GridHasSixTrianglesAtEveryInnerVertex) {
  const std::vector<std::int32_t> heights(17 * 17, 0);
  const proto::TileMesh mesh = gpu::grid_mesh(16, 1, heights);
  const auto neighbours = test::neighbours(mesh);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    if (mesh.x[v] % 16 && mesh.y[v] % 16) { EXPECT_EQ(neighbours[v].size(), 6u); }
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

TEST(Waves, UnknownDevicesAreNamed) {
  for (const char* device : {"gpu", "cuda:x", "cuda:-1", "cuda:"}) {
    const auto simplifier = gpu::make_simplifier(device);
    ASSERT_FALSE(simplifier.ok()) << device;
    EXPECT_NE(simplifier.problem().detail.find(device), std::string::npos);
  }
}

}  // namespace
}  // namespace cordillera
