#pragma once
// Meshes to fit, and the laws that a fit is held against. Errors are judged by gpu/fit/vertical_error, which shares no code with
// it.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "gpu/fit/simplify_height_mesh.h"
#include "gpu/fit/vertical_error.h"
#include "tests/bench/terrain.h"

namespace cordillera::gpu::fit {

template <class Height>
HeightMesh grid(std::uint32_t columns, std::uint32_t rows, double cell, const Height& height) {
  HeightMesh mesh;
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      mesh.x.push_back(1000 + c * cell);
      mesh.y.push_back(-500 + r * cell);
      mesh.z.push_back(height(c, r));
    }
  }
  mesh.triangles = bench::grid_triangles(columns, rows);
  return mesh;
}

inline HeightMesh terrain(bench::Terrain kind, std::uint32_t side) {
  constexpr std::uint32_t kOff = 300;  // where the alpine kind is no sea
  return grid(side, side, 30,
              [&](std::uint32_t c, std::uint32_t r) { return bench::terrain_height(kind, c + kOff, r + kOff) / 1024.0; });
}

inline double area_of(const HeightMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return ((mesh.x[t[1]] - mesh.x[t[0]]) * (mesh.y[t[2]] - mesh.y[t[0]]) -
          (mesh.y[t[1]] - mesh.y[t[0]]) * (mesh.x[t[2]] - mesh.x[t[0]])) /
         2;
}

inline double plan_area(const HeightMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) area += area_of(mesh, t);
  return area;
}

/// The first law that a result breaks: positive triangles that cover what the input covered, a manifold, one fan at every vertex.
inline std::string broken_law(const HeightMesh& in, const HeightMesh& out) {
  std::map<std::array<std::uint32_t, 2>, int> edges;
  std::vector<int> triangles_at(out.vertices()), edges_at(out.vertices()), borders_at(out.vertices());
  for (const auto& t : out.triangles) {
    if (!(area_of(out, t) > 0)) return "a triangle is turned";
    for (std::size_t k = 0; k < 3; ++k) {
      if (++edges[{t[k], t[(k + 1) % 3]}] > 1) return "two triangles on one side of an edge";
      ++triangles_at[t[k]];
    }
  }
  for (const auto& [edge, count] : edges) {
    const bool border = !edges.contains({edge[1], edge[0]});
    if (!border && edge[0] > edge[1]) continue;
    for (const std::uint32_t v : edge) {
      ++edges_at[v];
      borders_at[v] += border;
    }
  }
  for (std::size_t v = 0; v < out.vertices(); ++v) {
    if (borders_at[v] != 0 && borders_at[v] != 2) return "a vertex with two fans";
    if (edges_at[v] - triangles_at[v] != borders_at[v] / 2) return "a vertex that is no manifold";
    if (edges_at[v] > 16) return "a vertex with " + std::to_string(edges_at[v]) + " edges";
  }
  if (std::abs(std::abs(plan_area(in) / plan_area(out)) - 1) > 1e-7) return "the plan is not covered once";
  return "";
}

inline VerticalError judged(const HeightMesh& in, const HeightMesh& out) {
  proto::TriangleMesh surface;
  surface.x = out.x;
  surface.y = out.y;
  surface.z = out.z;
  surface.triangles = out.triangles;
  return vertical_error(surface, {in.x, in.y, in.z});
}

/// Simplifies on the CPU, and holds the result and its report against the laws and the judge.
inline SimplifiedMesh simplified(const HeightMesh& in, const MeshTarget& target, Quality quality = Quality::default_) {
  auto result = simplify(in, target, {.quality = quality, .device = "cpu"});
  EXPECT_TRUE(result.ok()) << result.problem().line();
  if (!result.ok()) return {};
  EXPECT_EQ(broken_law(in, result->mesh), "");
  const MeshReport& report = result->report;
  EXPECT_EQ(report.vertices, result->mesh.vertices());
  EXPECT_EQ(report.triangles, result->mesh.triangles.size());
  EXPECT_EQ(report.device, "cpu");
  const VerticalError error = judged(in, result->mesh);
  EXPECT_EQ(error.uncovered, 0u);
  EXPECT_NEAR(report.rmse_m, error.rmse, 5e-5 + 1e-4 * error.rmse);  // plan positions are rounded, which shows across needles
  EXPECT_NEAR(report.max_error_m, error.max, 1e-4 + 1e-3 * error.max);
  return std::move(*result);
}

inline constexpr Quality kQualities[] = {Quality::fast, Quality::default_, Quality::best, Quality::minimax};

}  // namespace cordillera::gpu::fit
