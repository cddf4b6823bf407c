#pragma once
// The arrays of a mesh, made from its vertices and triangles (section 4.2). Every step gathers: numbers do not depend on who is
// first.
#include "gpu/cleap/structure.h"
#include "gpu/device/atomic.h"

namespace cordillera::gpu::cleap {

/// By triangle: how many there are at each vertex.
struct CountTriangles {
  const std::int32_t* corner;
  std::uint32_t* count;
  CORDILLERA_HD void operator()(std::size_t t) const {
    for (std::size_t k = 0; k < 3; ++k) fetch_add(count + corner[3 * t + k], 1);
  }
};
/// By vertex: the longest row.
struct FindLongest {
  const std::uint32_t* count;
  std::uint32_t* most;
  CORDILLERA_HD void operator()(std::size_t v) const { raise_to(most, count[v]); }
};
struct EmptyRows {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t v) const {
    std::int32_t* const row = mesh.row(static_cast<std::int32_t>(v));
    row[0] = 0;
    row[1] = -1;
    mesh.border[v] = 0;
  }
};
/// By triangle; in any order.
struct FillRows {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t t) const {
    for (std::size_t k = 0; k < 3; ++k) {
      std::int32_t* const row = mesh.row(mesh.corner[3 * t + k]);
      row[2 + fetch_add(reinterpret_cast<std::uint32_t*>(row), 1)] = static_cast<std::int32_t>(t);
    }
    mesh.flag[t] = kFree;
  }
};
/// By vertex: the triangles of its row by number.
struct SortRow {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t v) const {
    std::int32_t* const row = mesh.row(static_cast<std::int32_t>(v));
    for (std::int32_t i = 1; i < row[0]; ++i) {
      const std::int32_t triangle = row[2 + i];
      std::int32_t k = i;
      for (; k > 0 && row[1 + k] > triangle; --k) row[2 + k] = row[1 + k];
      row[2 + k] = triangle;
    }
  }
};

/// Where a vertex stands in a triangle, 0 to 2; 3: nowhere.
CORDILLERA_HD inline std::int32_t place_in(const std::int32_t* corner, std::int32_t v) {
  for (std::int32_t k = 0; k < 3; ++k) {
    if (corner[k] == v) return k;
  }
  return 3;
}

/// The edges of which v is the lower end: f(w, triangle, other), in the order in which its row comes to them. other: the second
/// triangle or -1. crowded: there is a third.
template <class F>
CORDILLERA_HD void each_edge_up(const Arrays& mesh, std::int32_t v, const F& f) {
  const std::int32_t* const row = mesh.row(v);
  for (std::int32_t i = 0; i < row[0]; ++i) {
    const std::int32_t triangle = row[2 + i];
    const std::int32_t* const corner = mesh.corner + 3 * triangle;
    const std::int32_t at = place_in(corner, v);
    for (std::int32_t step = 1; step < 3; ++step) {
      const std::int32_t w = corner[(at + step) % 3];
      if (w < v) continue;
      bool seen = false, crowded = false;
      std::int32_t other = -1;
      for (std::int32_t k = 0; k < row[0]; ++k) {
        if (k == i || place_in(mesh.corner + 3 * row[2 + k], w) > 2) continue;
        if (k < i) seen = true;
        crowded = crowded || other >= 0;
        other = row[2 + k];
      }
      if (!seen) f(w, triangle, other, crowded);
    }
  }
}

struct CountEdges {
  Arrays mesh;
  std::uint32_t* count;
  std::uint32_t* crowded;  ///< set where an edge has more than two triangles
  CORDILLERA_HD void operator()(std::size_t v) const {
    std::uint32_t found = 0;
    bool full = false;
    each_edge_up(mesh, static_cast<std::int32_t>(v), [&](std::int32_t, std::int32_t, std::int32_t, bool many) {
      ++found;
      full = full || many;
    });
    count[v] = found;
    if (full) raise_to(crowded, 1);
  }
};
struct MakeEdges {
  Arrays mesh;
  const std::uint32_t* first;
  CORDILLERA_HD void operator()(std::size_t at) const {
    const auto v = static_cast<std::int32_t>(at);
    std::uint32_t next = first[at];
    each_edge_up(mesh, v, [&](std::int32_t w, std::int32_t triangle, std::int32_t other, bool) {
      Edge& edge = mesh.edge[next++];
      edge.n[0] = v;
      edge.n[1] = w;
      seat(edge, edge.a, edge.op, triangle);
      seat(edge, edge.b, edge.op + 1, other);
    });
  }

 private:
  CORDILLERA_HD void seat(const Edge& edge, std::int32_t* side, std::int32_t* op, std::int32_t triangle) const {
    side[0] = side[1] = *op = -1;
    if (triangle < 0) return;
    const std::int32_t* const corner = mesh.corner + 3 * triangle;
    side[0] = 3 * triangle + place_in(corner, edge.n[0]);
    side[1] = 3 * triangle + place_in(corner, edge.n[1]);
    *op = 3 * triangle + (3 - side[0] % 3 - side[1] % 3);
  }
};
/// By edge: its triangles know it; its ends, if it is on the border, that they are (Algorithm 8).
struct NoteEdge {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t e) const {
    const Edge& edge = mesh.edge[e];
    if (edge.n[0] < 0) return;
    if (mesh.edge_of) {
      mesh.edge_of[edge.op[0]] = static_cast<std::int32_t>(e);
      if (edge.op[1] >= 0) mesh.edge_of[edge.op[1]] = static_cast<std::int32_t>(e);
    }
    if (edge.b[0] >= 0) return;
    set_shared(mesh.border + edge.n[0], std::uint8_t{1});
    set_shared(mesh.border + edge.n[1], std::uint8_t{1});
  }
};

}  // namespace cordillera::gpu::cleap
