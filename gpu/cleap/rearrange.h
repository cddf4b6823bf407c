#pragma once
// The gaps closed (section 4.7.1). Two pointers walk towards each other: the first gap from the left is filled with the last
// vertex from the right, and so on. As published that is one after the other, with a pass over all triangles and edges for each
// swap. The same result comes from one scan: with n vertices left, the k-th gap below n gets the k-th vertex from the right.
#include "gpu/cleap/structure.h"

namespace cordillera::gpu::cleap {

struct MarkAlive {
  Arrays mesh;
  std::uint32_t* alive;
  CORDILLERA_HD void operator()(std::size_t v) const { alive[v] = mesh.is_gone(static_cast<std::int32_t>(v)) ? 0 : 1; }
};

/// before: indexed by vertex, how many alive there are before it; `left` of them in all.
struct FindGaps {
  Arrays mesh;
  const std::uint32_t* before;
  std::uint32_t left;
  std::int32_t* gap;  ///< the k-th
  CORDILLERA_HD void operator()(std::size_t v) const {
    if (v < left && mesh.is_gone(static_cast<std::int32_t>(v))) gap[v - before[v]] = static_cast<std::int32_t>(v);
  }
};
/// number: the new one of a vertex; of one that is gone nobody asks.
struct FillGaps {
  Arrays mesh;
  const std::uint32_t* before;
  std::uint32_t left;
  const std::int32_t* gap;
  std::int32_t* number;
  CORDILLERA_HD void operator()(std::size_t v) const {
    number[v] = static_cast<std::int32_t>(v);
    if (v < left || mesh.is_gone(static_cast<std::int32_t>(v))) return;
    const std::int32_t to = gap[left - 1 - before[v]];
    number[v] = to;
    mesh.vertex[to] = mesh.vertex[v];
    mesh.border[to] = mesh.border[v];
    if (mesh.tag) mesh.tag[to] = mesh.tag[v];
    if (mesh.quadric) mesh.quadric[to] = mesh.quadric[v];
  }
};
struct RenumberTriangle {
  Arrays mesh;
  const std::int32_t* number;
  CORDILLERA_HD void operator()(std::size_t t) const {
    std::int32_t* const corner = mesh.corner + 3 * t;
    if (is_gone_triangle(corner)) return;
    for (int k = 0; k < 3; ++k) corner[k] = number[corner[k]];
  }
};
struct RenumberEdge {
  Arrays mesh;
  const std::int32_t* number;
  CORDILLERA_HD void operator()(std::size_t e) const {
    Edge& edge = mesh.edge[e];
    if (edge.n[0] < 0) return;
    for (std::int32_t& v : edge.n) v = number[v];
  }
};

/// Algorithms 19 and 20: one swap, over all triangles and all edges.
struct SwapInTriangle {
  Arrays mesh;
  std::int32_t from, to;
  CORDILLERA_HD void operator()(std::size_t t) const {
    std::int32_t* const corner = mesh.corner + 3 * t;
    if (is_gone_triangle(corner)) return;
    for (int k = 0; k < 3; ++k) {
      if (corner[k] == from) corner[k] = to;
    }
  }
};
struct SwapInEdge {
  Arrays mesh;
  std::int32_t from, to;
  CORDILLERA_HD void operator()(std::size_t e) const {
    for (std::int32_t& v : mesh.edge[e].n) {
      if (v == from) v = to;
    }
  }
};

/// The triangles that are left, in their order.
struct MarkTriangle {
  Arrays mesh;
  std::uint32_t* alive;
  CORDILLERA_HD void operator()(std::size_t t) const { alive[t] = is_gone_triangle(mesh.corner + 3 * t) ? 0 : 1; }
};
struct MoveTriangle {
  Arrays mesh;
  const std::uint32_t* before;
  std::int32_t* to;
  CORDILLERA_HD void operator()(std::size_t t) const {
    const std::int32_t* const corner = mesh.corner + 3 * t;
    if (is_gone_triangle(corner)) return;
    for (std::size_t k = 0; k < 3; ++k) to[3 * before[t] + k] = corner[k];
  }
};

}  // namespace cordillera::gpu::cleap
