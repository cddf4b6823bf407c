#pragma once
// Which triangle lies beyond each edge of a triangle.
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace cordillera::gpu {

inline constexpr std::uint32_t kNoTriangle = UINT32_MAX;

/// Corners of a triangle in their order.
constexpr unsigned after(unsigned k) { return k == 2 ? 0 : k + 1; }
constexpr unsigned before(unsigned k) { return k == 0 ? 2 : k - 1; }

/// Half-edge 3 t + k runs from corner k of triangle t to the next.
inline constexpr std::uint32_t kNoEdge = UINT32_MAX;

/// Indexed by half-edge: the one between the same vertices in another triangle; kNoEdge on the border. Where more than two are,
/// each is with the one that came before it, if that is with none.
inline std::vector<std::uint32_t> twin_edges(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::uint32_t most = 0;
  for (const auto& t : triangles) most = std::max({most, t[0], t[1], t[2]});
  struct Edge {
    std::uint32_t high, next;  ///< its greater vertex; the next one in the list
  };
  std::vector<Edge> edges(3 * triangles.size());
  std::vector<std::uint32_t> twin(edges.size(), kNoEdge);
  std::vector<std::uint32_t> alone(std::size_t{most} + 1, kNoEdge);  // indexed by lesser vertex: a list of edges without a twin
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (unsigned k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][after(k)]);
      std::uint32_t* at = &alone[low];
      while (*at != kNoEdge && edges[*at].high != high) at = &edges[*at].next;
      const std::uint32_t edge = 3 * t + k, other = *at;
      if (other != kNoEdge) {
        *at = edges[other].next;
        twin[edge] = other;
        twin[other] = edge;
      } else {
        edges[edge] = {high, kNoEdge};
        *at = edge;
      }
    }
  }
  return twin;
}

/// [t][k]: the triangle beyond the edge from corner k of t to the next; kNoTriangle on the border. Of a manifold.
inline std::vector<std::array<std::uint32_t, 3>> neighbours(std::span<const std::array<std::uint32_t, 3>> triangles) {
  const std::vector<std::uint32_t> twin = twin_edges(triangles);
  std::vector<std::array<std::uint32_t, 3>> across(triangles.size());
  for (std::size_t e = 0; e < twin.size(); ++e) across[e / 3][e % 3] = twin[e] == kNoEdge ? kNoTriangle : twin[e] / 3;
  return across;
}

}  // namespace cordillera::gpu
