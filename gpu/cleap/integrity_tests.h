#pragma once
// What a candidate must pass (section 4.5): inversion, border, neighbours.
//
// Readings. Inversion: Algorithm 7 compares normals for equality, which only flat ground passes; the text asks that no signed
// area change its sign, and so do we, with the area in the plan, for terrains are height fields. The listing is kept as an
// option: the published counts look like it. Neighbours: Algorithm 10 leaves out the -4 of equation 4.1, and the text says both <
// c and <= c; we take the equation and <=, so the listing's c is ours plus 4.
#include "gpu/cleap/candidate.h"
#include "gpu/cleap/quadric.h"

namespace cordillera::gpu::cleap {

/// Twice the signed area in the plan: its sign where rounding cannot change it, else 0.
CORDILLERA_HD inline int turn_of(const Position& p, const Position& q, const Position& r) {
  const double one = (q.x - p.x) * (r.y - p.y), other = (q.y - p.y) * (r.x - p.x), area = one - other;
  const double size = (one < 0 ? -one : one) + (other < 0 ? -other : other);
  constexpr double kRounding = 1e-15;  // more than three and a half roundings of a double
  return area > kRounding * size ? 1 : area < -kRounding * size ? -1 : 0;
}

/// Algorithm 7 as it stands, in the floats that a GPU of its day would have used.
CORDILLERA_HD inline bool same_normal(const Position (&before)[3], const Position (&after)[3]) {
  const Plane p = plane_through(before[0], before[1], before[2]), q = plane_through(after[0], after[1], after[2]);
  return static_cast<float>(p.a) == static_cast<float>(q.a) && static_cast<float>(p.b) == static_cast<float>(q.b) &&
         static_cast<float>(p.c) == static_cast<float>(q.c);
}

struct TestCandidate {
  Arrays mesh;
  Window window;
  Border border;
  std::int32_t most_triangles;  ///< c, at a vertex
  Inversion inversion;

  CORDILLERA_HD void operator()(std::size_t i) const {
    if (!goes(window.fate[i])) return;
    const Edge& edge = mesh.edge[window.edge[i]];
    if (inverts(edge, window.to[i]))
      window.fate[i] = Fate::inverted;
    else if (border == Border::keep && touches_border(edge))
      window.fate[i] = Fate::border;
    else if (crowds(i, edge))
      window.fate[i] = Fate::crowded;
  }

 private:
  /// Algorithms 6 and 7. The triangles at the corners opposite are of the vicinity, but only those at the ends can change.
  CORDILLERA_HD bool inverts(const Edge& edge, const Position& to) const {
    const std::int32_t v1 = edge.n[0], v2 = edge.n[1], dead_a = edge.a[0] / 3, dead_b = edge.b[0] < 0 ? -1 : edge.b[0] / 3;
    const auto keeps_side = [&](std::int32_t triangle) {
      if (triangle == dead_a || triangle == dead_b) return true;
      const std::int32_t* const corner = mesh.corner + 3 * triangle;
      Position before[3], after[3];
      for (int k = 0; k < 3; ++k) {
        before[k] = mesh.vertex[corner[k]];
        after[k] = corner[k] == v1 || corner[k] == v2 ? to : before[k];
      }
      if (inversion == Inversion::normals && !same_normal(before, after)) return false;
      const int turn = turn_of(after[0], after[1], after[2]);
      return turn != 0 && turn == turn_of(before[0], before[1], before[2]);
    };
    return !all_triangles_at(mesh, v1, keeps_side) || !all_triangles_at(mesh, v2, keeps_side);
  }
  /// Algorithm 9. A single triangle left between an edge with two and the border could lose its last neighbour: an inner edge
  /// that joins two places of the border never goes.
  CORDILLERA_HD bool touches_border(const Edge& edge) const { return mesh.border[edge.n[0]] || mesh.border[edge.n[1]]; }
  /// Algorithm 10 with equation 4.1; an edge on the border takes 2 away. The vertices of a tile have
  /// caps of their own; one that a weld left above its cap may only lose.
  CORDILLERA_HD bool crowds(std::size_t i, const Edge& edge) const {
    const std::int32_t first = triangles_at(mesh, edge.n[0]), second = triangles_at(mesh, edge.n[1]);
    const std::int32_t left = first + second - (edge.b[0] < 0 ? 2 : 4);
    if (!mesh.tag) return left > most_triangles;
    const Tag& tag = window.tag[i];
    const std::int32_t most = most_triangles_of(tag.mark) < most_triangles ? most_triangles_of(tag.mark) : most_triangles;
    return left > most && left > (mesh.tag[edge.n[0]].original == tag.original ? first : second);
  }
};

}  // namespace cordillera::gpu::cleap
