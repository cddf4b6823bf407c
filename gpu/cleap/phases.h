#pragma once
// The collapse in four phases (section 4.6): elimination, and the repair of triangles, of edges and of what connects them. What
// is deleted serves as a mailbox between phases.
//
// Readings. A triangle is gone if all of its corners are 0; Algorithm 13 would pass over every triangle at vertex 0. Of two edges
// that merge the one of the higher number stays, as in Algorithms 15 to 17 and Figure C.11; a sentence of section 4.6.4 has it
// the other way. The listings look up vertex -1 of edges that are gone; ours leave first.
#include "gpu/cleap/candidate.h"
#include "gpu/device/atomic.h"

namespace cordillera::gpu::cleap {

/// Takes a triangle out of a vertex' row, or of those where it continues; the last of the row takes its place (Figures B.3, B.5).
CORDILLERA_HD inline void drop_triangle(const Arrays& mesh, std::int32_t v, std::int32_t triangle) {
  for (std::int32_t at = v; at >= 0; at = mesh.row(at)[1]) {
    std::int32_t* const row = mesh.row(at);
    for (std::int32_t k = 0; k < row[0]; ++k) {
      if (row[2 + k] != triangle) continue;
      for (--row[0]; k < row[0]; ++k) row[2 + k] = row[3 + k];
      return;
    }
  }
}

/// Section 4.6.1, Algorithms 11 and 12, appendix B.
struct Eliminate {
  Arrays mesh;
  Window window;

  CORDILLERA_HD void operator()(std::size_t i) const {
    if (!goes(window.fate[i])) return;
    Edge& edge = mesh.edge[window.edge[i]];
    const bool ascending = edge.n[0] < edge.n[1];
    const std::int32_t v1 = edge.n[ascending ? 0 : 1], v2 = edge.n[ascending ? 1 : 0];
    const std::int32_t dead[2] = {edge.a[0] / 3, edge.b[0] < 0 ? -1 : edge.b[0] / 3};
    for (int k = 0; k < 2; ++k) {
      window.left[3 * i + k] = dead[k];
      if (dead[k] >= 0) remove(dead[k]);
    }
    window.left[3 * i + 2] = v2;
    continue_row(v2, v1);
    mesh.vertex[v2] = window.to[i];
    const auto heir = static_cast<double>(v2);
    mesh.vertex[v1] = {kInfinite, heir, heir};
    mesh.border[v2] = mesh.border[v1] | mesh.border[v2];
    if (mesh.tag) mesh.tag[v2] = window.tag[i];
    if (mesh.quadric) mesh.quadric[v2] = sum(mesh.quadric[v1], mesh.quadric[v2]);
    edge = {{-1, -1}, {-1, -1}, {-1, -1}, {-1, -1}};
  }

 private:
  CORDILLERA_HD void remove(std::int32_t triangle) const {
    std::int32_t* const corner = mesh.corner + 3 * triangle;
    for (int k = 0; k < 3; ++k) drop_triangle(mesh, corner[k], triangle);
    corner[0] = corner[1] = corner[2] = 0;
  }
  /// Figure B.7; after what either already continues in.
  CORDILLERA_HD void continue_row(std::int32_t v, std::int32_t in) const {
    std::int32_t last = v;
    while (mesh.row(last)[1] >= 0) last = mesh.row(last)[1];
    mesh.row(last)[1] = in;
  }
};

/// By triangle: section 4.6.2, Algorithm 13.
struct RepairTriangle {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t t) const {
    std::int32_t* const corner = mesh.corner + 3 * t;
    if (is_gone_triangle(corner)) return;
    for (int k = 0; k < 3; ++k) {
      const Position& at = mesh.vertex[corner[k]];
      if (at.x == kInfinite) set_shared(corner + k, static_cast<std::int32_t>(at.y));
    }
  }
};

/// By edge: section 4.6.3, Algorithm 14. Two edges may write the same corner of a dead triangle: either number will do.
struct RepairEdge {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t e) const {
    Edge& edge = mesh.edge[e];
    if (edge.n[0] < 0) return;
    for (int k = 0; k < 2; ++k) {
      const Position& at = mesh.vertex[edge.n[k]];
      if (at.x == kInfinite) edge.n[k] = static_cast<std::int32_t>(at.y);
    }
    report(edge.a, static_cast<std::int32_t>(e));
    report(edge.b, static_cast<std::int32_t>(e));
  }

 private:
  CORDILLERA_HD void report(const std::int32_t* side, std::int32_t e) const {
    if (side[0] < 0) return;
    std::int32_t* const corner = mesh.corner + side[0] / 3 * 3;
    const std::int32_t c0 = get_shared(corner), c1 = get_shared(corner + 1), c2 = get_shared(corner + 2);
    if (c0 != c1 && c1 != c2 && c2 != c0) return;
    set_shared(mesh.corner + side[0], e);
    set_shared(mesh.corner + side[1], e);
  }
};

/// By triangle: section 4.6.4, Algorithms 15 to 17. Edge 0 is a number like any other: three corners that are all alike, not
/// two that are 0, say that nothing is left to merge.
struct RepairConnection {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t t) const {
    std::int32_t* const corner = mesh.corner + 3 * t;
    const std::int32_t c0 = corner[0], c1 = corner[1], c2 = corner[2];
    if (c0 != c1 && c1 != c2 && c2 != c0) return;
    if (c0 == c1 && c1 == c2) return;
    const std::int32_t one = c0 == c1 ? c0 : c2, other = c0 == c1 ? c2 : c1 == c2 ? c0 : c1;
    merge(one < other ? one : other, one < other ? other : one, static_cast<std::int32_t>(t));
    corner[0] = corner[1] = corner[2] = 0;
  }

 private:
  /// caseDetection: the side of the lower edge that is not dead becomes the higher one's in place of that which is.
  CORDILLERA_HD void merge(std::int32_t lower, std::int32_t higher, std::int32_t dead) const {
    Edge &from = mesh.edge[lower], &to = mesh.edge[higher];
    const bool from_b = from.a[0] >= 0 && from.a[0] / 3 == dead, to_a = to.a[0] >= 0 && to.a[0] / 3 == dead;
    const std::int32_t* const side = from_b ? from.b : from.a;
    const std::int32_t op = from.op[from_b ? 1 : 0];
    // The ends of both edges are the same by now, but perhaps the other way round.
    const bool same_way = from.n[0] == to.n[0];
    std::int32_t* const into = to_a ? to.a : to.b;
    into[0] = side[same_way ? 0 : 1];
    into[1] = side[same_way ? 1 : 0];
    to.op[to_a ? 0 : 1] = op;
    if (mesh.edge_of && op >= 0) mesh.edge_of[op] = higher;
    if (to.a[0] < 0) lead_with_b(to);
    from = {{-1, -1}, {-1, -1}, {-1, -1}, {-1, -1}};
  }
  /// An edge that came to lie on the border has its one triangle first.
  CORDILLERA_HD static void lead_with_b(Edge& edge) {
    edge.a[0] = edge.b[0];
    edge.a[1] = edge.b[1];
    edge.op[0] = edge.op[1];
    edge.b[0] = edge.b[1] = edge.op[1] = -1;
  }
};

/// By candidate, ours: the three repairs, but only of what its collapse touched; needs edge_of. The same functions, so the same
/// mesh.
struct RepairAround {
  Arrays mesh;
  Window window;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (!goes(window.fate[i])) return;
    const std::int32_t* const dead = window.left + 3 * i;
    const std::int32_t v = dead[2];
    all_triangles_at(mesh, v, [&](std::int32_t triangle) {
      RepairTriangle{mesh}(static_cast<std::size_t>(triangle));
      return true;
    });
    all_triangles_at(mesh, v, [&](std::int32_t triangle) {
      repair_edges(triangle);
      return true;
    });
    for (int k = 0; k < 2; ++k) {
      if (dead[k] >= 0) repair_edges(dead[k]);
    }
    for (int k = 0; k < 2; ++k) {
      if (dead[k] >= 0) RepairConnection{mesh}(static_cast<std::size_t>(dead[k]));
    }
  }

 private:
  CORDILLERA_HD void repair_edges(std::int32_t triangle) const {
    for (int k = 0; k < 3; ++k) RepairEdge{mesh}(static_cast<std::size_t>(mesh.edge_of[3 * triangle + k]));
  }
};

}  // namespace cordillera::gpu::cleap
