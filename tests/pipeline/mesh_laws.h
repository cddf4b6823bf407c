#pragma once
// What every tile mesh must be, looked at afresh: the tests of several files assert it.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::test {

struct Valences {
  std::size_t inside = 0, sides = 0, corners = 0;
};

inline bool on_west_or_east(const proto::TileMesh& m, std::size_t v) { return m.x[v] == 0 || m.x[v] == m.side; }
inline bool on_south_or_north(const proto::TileMesh& m, std::size_t v) { return m.y[v] == 0 || m.y[v] == m.side; }

inline std::int64_t twice_area(const proto::TileMesh& m, const std::array<std::uint32_t, 3>& t) {
  const std::int64_t ax = m.x[t[1]] - m.x[t[0]], ay = m.y[t[1]] - m.y[t[0]];
  const std::int64_t bx = m.x[t[2]] - m.x[t[0]], by = m.y[t[2]] - m.y[t[0]];
  return ax * by - ay * bx;
}

/// Neighbours of every vertex; empty where a vertex is in no triangle.
inline std::vector<std::set<std::uint32_t>> neighbours(const proto::TileMesh& m) {
  std::vector<std::set<std::uint32_t>> found(m.vertices());
  for (const auto& t : m.triangles)
    for (int k = 0; k < 3; ++k) {
      found[t[k]].insert(t[(k + 1) % 3]);
      found[t[(k + 1) % 3]].insert(t[k]);
    }
  return found;
}

inline Valences valences(const proto::TileMesh& m) {
  Valences most;
  const auto found = neighbours(m);
  for (std::size_t v = 0; v < m.vertices(); ++v) {
    const int sides = int{on_west_or_east(m, v)} + int{on_south_or_north(m, v)};
    std::size_t& kind = sides == 2 ? most.corners : sides == 1 ? most.sides : most.inside;
    kind = std::max(kind, found[v].size());
  }
  return most;
}

/// Empty when the triangles cover the rectangle exactly, each with positive area, edges matching; else what is wrong.
inline std::string broken_law(const proto::TileMesh& m) {
  std::int64_t area = 0;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : m.triangles) {
    const std::int64_t twice = twice_area(m, t);
    if (twice <= 0) return "a triangle without positive area";
    area += twice;
    for (int k = 0; k < 3; ++k)
      if (++edges[{t[k], t[(k + 1) % 3]}] > 1) return "an edge used twice in one direction";
  }
  if (area != 2 * std::int64_t{m.side} * m.side) return "the rectangle is not covered";
  for (const auto& [edge, count] : edges) {
    if (edges.count({edge.second, edge.first})) continue;
    const auto [a, b] = edge;
    const bool border = (m.x[a] == m.x[b] && on_west_or_east(m, a)) || (m.y[a] == m.y[b] && on_south_or_north(m, a));
    if (!border) return "an inner edge with one triangle";
  }
  std::set<std::pair<std::int32_t, std::int32_t>> places;
  const auto found = neighbours(m);
  for (std::size_t v = 0; v < m.vertices(); ++v) {
    if (found[v].empty()) return "a vertex without triangles";
    if (!places.insert({m.x[v], m.y[v]}).second) return "two vertices in one place";
  }
  return {};
}

}  // namespace cordillera::test
