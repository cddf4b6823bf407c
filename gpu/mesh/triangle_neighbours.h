#pragma once
// Which triangle lies beyond each edge of a triangle.
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace cordillera::gpu {

inline constexpr std::uint32_t kNoTriangle = UINT32_MAX;

/// Corners of a triangle in their order.
constexpr unsigned after(unsigned k) { return k == 2 ? 0 : k + 1; }
constexpr unsigned before(unsigned k) { return k == 0 ? 2 : k - 1; }

/// [t][k]: the triangle beyond the edge from corner k of t to the next; kNoTriangle on the border. Of a manifold.
inline std::vector<std::array<std::uint32_t, 3>> neighbours(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> edges;
  edges.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (unsigned k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][after(k)]);
      edges.emplace_back(std::uint64_t{low} << 32 | high, 3 * t + k);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<std::array<std::uint32_t, 3>> across(triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
  for (std::size_t e = 0; e + 1 < edges.size(); ++e) {
    if (edges[e].first != edges[e + 1].first) continue;
    const std::uint32_t a = edges[e].second, b = edges[e + 1].second;
    across[a / 3][a % 3] = b / 3;
    across[b / 3][b % 3] = a / 3;
  }
  return across;
}

}  // namespace cordillera::gpu
