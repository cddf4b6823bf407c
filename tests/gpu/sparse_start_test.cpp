// What the simplifier starts from where it may leave vertices out before the first wave.
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "gpu/simplify.h"
#include "tests/bench/pyramid/terrain.h"
#include "tests/gpu/sparse_grid.h"

namespace cordillera {
namespace {

/// A grid of `cells`, with marks as a chain and a caller may have set them.
proto::TileMesh marked_grid(bench::Terrain kind, std::int32_t cells) {
  std::vector<std::int32_t> heights;
  for (std::int32_t y = 0; y <= cells; ++y) {
    for (std::int32_t x = 0; x <= cells; ++x) heights.push_back(bench::terrain_height(kind, 3 * x + 900, 3 * y + 700));
  }
  proto::TileMesh mesh = gpu::grid_mesh(cells, 1, heights);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const bool side = mesh.x[v] % cells == 0 || mesh.y[v] % cells == 0, corner = mesh.x[v] % cells == 0 && mesh.y[v] % cells == 0;
    if (side && !corner)
      mesh.mark[v] |= (mesh.x[v] + mesh.y[v]) % 8 == 0 || (mesh.mark[v] & proto::kVoid) ? proto::kKeep : proto::kRemove;
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
TEST(SparseStart, IsTheSparseGrid) {
  const auto cpu = gpu::make_simplifier("cpu");
  for (const auto kind : {bench::Terrain::alpine, bench::Terrain::islands, bench::Terrain::plane, bench::Terrain::city}) {
    for (const std::int32_t cells : {1, 2, 8, 64}) {
      for (const float tolerance_m : {0.25f, 40.0f}) {
        const proto::TileMesh grid = marked_grid(kind, cells);
        const std::vector<float> elevation = metres(grid);
        const test::SparseGrid start = test::sparse_grid(grid, elevation, tolerance_m);
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
TEST(SparseStart, DoesNotDependOnTheBatch) {
  std::vector<proto::TileMesh> inputs;
  for (const std::int32_t cells : {32, 64, 8, 64, 16}) {
    proto::TileMesh& mesh = inputs.emplace_back(marked_grid(bench::Terrain::islands, cells));
    for (std::size_t v = 0; v < mesh.vertices(); ++v) {  // corners stay though nothing marks them
      const bool corner = (mesh.x[v] == 0 || mesh.x[v] == mesh.side) && (mesh.y[v] == 0 || mesh.y[v] == mesh.side);
      if (corner) mesh.mark[v] = static_cast<std::uint8_t>(mesh.mark[v] & ~proto::kKeep);
    }
  }
  std::vector<std::vector<float>> elevations;
  for (const auto& input : inputs) elevations.push_back(metres(input));
  test::SparseGrid start = test::sparse_grid(inputs[3], elevations[3], 1);
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

TEST(SparseStart, AsksForAGrid) {
  proto::TileMesh grid = marked_grid(bench::Terrain::plane, 6);
  const std::vector<float> elevation = metres(grid);
  gpu::SimplifyJob job{&grid, elevation, 1, 5, 5, 1};
  job.start_tolerance_m = 1;
  const auto cpu = gpu::make_simplifier("cpu");
  EXPECT_THROW((*cpu)->simplify({&job, 1}), std::invalid_argument);
}

}  // namespace
}  // namespace cordillera
