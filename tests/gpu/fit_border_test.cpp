// Border vertices that may not move are where they were, however long the edge that collapses onto them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::gpu::fit {
namespace {

constexpr std::uint32_t kSide = 6;

/// A few large triangles whose vertices lie on no line: with so few, edges are longer than 2^24 units of the plan.
HeightMesh shaken(double phase) {
  HeightMesh mesh;
  for (std::uint32_t k = 0; k < kSide * kSide; ++k) {
    const double c = k % kSide, r = k / kSide;
    mesh.x.push_back(c + 0.3 * std::sin(12.9898 * c + 78.233 * r + phase));
    mesh.y.push_back(r + 0.3 * std::sin(39.3467 * c + 11.135 * r));
    mesh.z.push_back(40 * std::sin(0.3 * c) * std::cos(0.2 * r) + 3 * std::sin(1.7 * c + r));
  }
  for (std::uint32_t k = 0; k < kSide * (kSide - 1); ++k) {
    if (k % kSide == kSide - 1) continue;
    mesh.triangles.push_back({k, k + 1, k + kSide + 1});
    mesh.triangles.push_back({k, k + kSide + 1, k + kSide});
  }
  return mesh;
}

std::set<std::uint32_t> border_of(const HeightMesh& mesh) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) edges.insert({t[k], t[(k + 1) % 3]});
  std::set<std::uint32_t> border;
  for (const auto& [a, b] : edges)
    if (!edges.contains({b, a})) border.insert({a, b});
  return border;
}

TEST(FitBorder, staysWhereItIsAtTheEndsOfLongEdges) {
  for (int phase = 0; phase < 8; ++phase) {
    const HeightMesh input = shaken(phase);
    const auto [west, east] = std::minmax_element(input.x.begin(), input.x.end());
    const auto [south, north] = std::minmax_element(input.y.begin(), input.y.end());
    const double unit = std::max(*east - *west, *north - *south) / (1 << 26);
    for (const Quality quality : {Quality::fast, Quality::default_}) {
      const auto result = simplify(input, MeshTarget::keep(0.4), {quality, "cpu"});
      ASSERT_TRUE(result.ok()) << result.problem().line();
      const HeightMesh& mesh = result->mesh;
      for (const std::uint32_t v : border_of(mesh)) {
        double nearest = INFINITY;
        for (std::size_t k = 0; k < input.vertices(); ++k)
          nearest = std::min(nearest, std::hypot(input.x[k] - mesh.x[v], input.y[k] - mesh.y[v]));
        EXPECT_LT(nearest, 0.75 * unit) << "phase " << phase << ", vertex " << v;
      }
    }
  }
}

}  // namespace
}  // namespace cordillera::gpu::fit
