#pragma once
// A tile of samples made by a formula, measured: for what changes a mesh within an error.
#include <gtest/gtest.h>

#include <cmath>

#include "gpu/measure/sample_meter.h"
#include "gpu/measure/surface_error.h"
#include "gpu/mesh/valence_limits.h"
#include "tests/gpu/grid_mesh.h"

namespace cordillera::gpu {

using proto::TileMesh;

inline constexpr std::int32_t kSide = 256;
inline const proto::Lattice kLattice{14};
inline constexpr proto::TileAddress kTile{14, 17000, 12000};

using Height = double (*)(int x, int y);
inline constexpr Height kHills = [](int x, int y) {
  return 300 + 40 * std::sin(0.07 * x) * std::cos(0.05 * y) + ((x * 7 + y * 13) % 17) * 0.3;
};
inline constexpr Height kWalls = [](int x, int y) { return (x / 9 + y / 7) % 3 == 0 ? 40.0 : 0.0; };
inline constexpr Height kSpike = [](int x, int y) { return x == 100 && y == 3 ? 500.0 : 20.0; };

inline proto::Samples samples_of(Height height) {
  proto::Samples s{kLattice.west(kTile), kLattice.south(kTile), kSide + 1, kSide + 1, {}, {}};
  for (int y = 0; y <= kSide; ++y)
    for (int x = 0; x <= kSide; ++x) s.height.push_back(static_cast<std::int32_t>(std::lround(height(x, y) * 1024)));
  return s;
}

/// A coarse grid over the samples; its border is what the samples make it, so that a border can be within a limit.
inline TileMesh coarse(const proto::Samples& s, int cells) {
  std::vector<std::int32_t> heights;
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x)
      heights.push_back(s.height[static_cast<std::size_t>(y * kSide / cells * (kSide + 1) + x * kSide / cells)]);
  return grid_mesh(cells, kSide / cells, heights);
}

inline SurfaceErrorInput input_of(const TileMesh& mesh, const proto::Samples& samples) {
  SurfaceErrorInput in;
  in.lattice = &kLattice;
  in.tile = kTile;
  in.mesh = &mesh;
  in.samples = &samples;
  in.ecef_steps = 1.0 / 256;
  return in;
}

inline std::vector<std::uint32_t> over(const TileMesh& mesh, const proto::Samples& samples, double limit_m) {
  return triangles_over(surface_error(input_of(mesh, samples), limit_m));
}

inline void expect_lawful(const TileMesh& mesh) {
  std::int64_t area = 0;
  for (const auto& t : mesh.triangles) {
    const std::int64_t twice = std::int64_t{mesh.x[t[1]] - mesh.x[t[0]]} * (mesh.y[t[2]] - mesh.y[t[0]]) -
                               std::int64_t{mesh.y[t[1]] - mesh.y[t[0]]} * (mesh.x[t[2]] - mesh.x[t[0]]);
    EXPECT_GT(twice, 0);
    area += twice;
  }
  EXPECT_EQ(area, 2LL * kSide * kSide);
  std::vector<std::size_t> around(mesh.vertices());
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) ++around[v];
  for (std::uint32_t v = 0; v < around.size(); ++v) EXPECT_LE(around[v], is_void(mesh, v) ? kVoidInside : kMostValence);
}

}  // namespace cordillera::gpu
