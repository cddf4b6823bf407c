#pragma once
// A mesh whose arrays are written down, for tests of single phases: numbers of triangles and edges are the example's own.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "gpu/cleap/build_steps.h"

namespace cordillera::gpu::cleap {

struct Example {
  std::vector<Position> vertex;
  std::vector<std::array<std::int32_t, 3>> corner;
  std::vector<Edge> edge;
  std::vector<std::int32_t> table, edge_of;
  std::vector<std::uint8_t> border;
  std::vector<std::uint32_t> flag;
  Arrays arrays;

  using Ends = std::vector<std::array<std::int32_t, 2>>;
  Example(std::vector<Position> vertices, std::vector<std::array<std::int32_t, 3>> triangles, const Ends& ends)
      : vertex(std::move(vertices)), corner(std::move(triangles)) {
    arrays.row_places = 12;
    table.assign(vertex.size() * (arrays.row_places + 2), -7);
    border.assign(vertex.size(), 9);
    flag.assign(corner.size(), 9);
    edge_of.assign(3 * corner.size(), -1);
    arrays.vertices = static_cast<std::uint32_t>(vertex.size());
    arrays.triangles = static_cast<std::uint32_t>(corner.size());
    arrays.vertex = vertex.data();
    arrays.corner = corner.front().data();
    arrays.table = table.data();
    arrays.border = border.data();
    arrays.flag = flag.data();
    each(vertex.size(), EmptyRows{arrays});
    each(corner.size(), FillRows{arrays});
    each(vertex.size(), SortRow{arrays});
    for (const auto& end : ends) edge.push_back(edge_between(end[0], end[1]));
    connect();
  }
  /// Edges as the program would number them.
  Example(std::vector<Position> vertices, std::vector<std::array<std::int32_t, 3>> triangles)
      : Example(std::move(vertices), std::move(triangles), {}) {
    std::vector<std::uint32_t> count(vertex.size()), first(vertex.size() + 1);
    std::uint32_t crowded = 0;
    each(vertex.size(), CountEdges{arrays, count.data(), &crowded});
    for (std::size_t v = 0; v < vertex.size(); ++v) first[v + 1] = first[v] + count[v];
    edge.resize(first.back());
    arrays.edge = edge.data();
    each(vertex.size(), MakeEdges{arrays, first.data()});
    connect();
  }

  template <class F>
  static void each(std::size_t n, const F& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }
  std::vector<std::int32_t> row(std::int32_t v) const {
    const std::int32_t* const at = arrays.row(v);
    return {at + 2, at + 2 + at[0]};
  }
  std::int32_t edge_number(std::int32_t v, std::int32_t w) const {
    for (std::size_t e = 0; e < edge.size(); ++e) {
      const std::int32_t* const n = edge[e].n;
      if ((n[0] == v && n[1] == w) || (n[0] == w && n[1] == v)) return static_cast<std::int32_t>(e);
    }
    return -1;
  }
  std::array<std::int32_t, 2> triangles_of(std::size_t e) const {
    const std::int32_t a = edge[e].a[0] / 3, b = edge[e].b[0] < 0 ? -1 : edge[e].b[0] / 3;
    return a < b ? std::array{a, b} : std::array{b, a};
  }
  /// What the redundancy of the arrays lets one check.
  void expect_consistent() const {
    const std::int32_t* const places = corner.front().data();
    for (std::size_t e = 0; e < edge.size(); ++e) {
      const Edge& it = edge[e];
      if (it.n[0] < 0) continue;
      for (int side = 0; side < 2; ++side) {
        const std::int32_t* const at = side ? it.b : it.a;
        if (at[0] < 0) continue;
        EXPECT_EQ(places[at[0]], it.n[0]) << "edge " << e;
        EXPECT_EQ(places[at[1]], it.n[1]) << "edge " << e;
        EXPECT_EQ(at[0] / 3, it.op[side] / 3) << "edge " << e;
        EXPECT_TRUE(it.op[side] != at[0] && it.op[side] != at[1]) << "edge " << e;
      }
    }
  }

 private:
  void connect() {
    arrays.edges = static_cast<std::uint32_t>(edge.size());
    arrays.edge = edge.data();
    arrays.edge_of = edge_of.data();
    each(edge.size(), NoteEdge{arrays});
  }
  Edge edge_between(std::int32_t v, std::int32_t w) const {
    Edge found{{v, w}, {-1, -1}, {-1, -1}, {-1, -1}};
    for (std::size_t t = 0; t < corner.size(); ++t) {
      const std::int32_t first = place_in(corner[t].data(), v), second = place_in(corner[t].data(), w);
      if (first > 2 || second > 2) continue;
      const int side = found.a[0] < 0 ? 0 : 1;
      const auto at = static_cast<std::int32_t>(3 * t);
      std::int32_t* const places = side ? found.b : found.a;
      places[0] = at + first;
      places[1] = at + second;
      found.op[side] = at + 3 - first - second;
    }
    return found;
  }
};

/// The mesh that fits what appendices B and C say: edge 4 joins vertices 6 and 7; triangles 1 and 5 lie beside it, 0, 6 and 7 at
/// vertex 6, where edges 1, 2, 11 and 13 end; edges 2 and 3 are triangle 1's, 10 and 11 triangle 5's.
inline Example appendix_mesh() {
  return {
      {{0, 1.8, 0}, {0, 0.2, 0}, {1.5, 2, 0}, {1.5, 0, 0}, {3, 1.8, 0}, {3, 0.2, 0}, {1, 1, 4}, {2, 1, 8}},
      {{6, 2, 0}, {6, 7, 2}, {7, 4, 2}, {7, 5, 4}, {7, 3, 5}, {7, 6, 3}, {6, 1, 3}, {6, 0, 1}},
      {{2, 0}, {6, 0}, {6, 2}, {7, 2}, {6, 7}, {2, 4}, {7, 4}, {4, 5}, {7, 5}, {5, 3}, {7, 3}, {6, 3}, {1, 3}, {6, 1}, {0, 1}}};
}

/// Columns by rows of vertices a unit apart, six triangles at each inner one; vertex number = row * columns + column.
inline Example grid_example(std::int32_t columns, std::int32_t rows) {
  std::vector<Position> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (std::int32_t v = 0; v < columns * rows; ++v) {
    vertices.push_back({static_cast<double>(v % columns), static_cast<double>(v / columns), 0});
    if (v % columns + 1 == columns || v / columns + 1 == rows) continue;
    triangles.push_back({v, v + 1, v + columns + 1});
    triangles.push_back({v, v + columns + 1, v + columns});
  }
  return {vertices, triangles};
}

}  // namespace cordillera::gpu::cleap
