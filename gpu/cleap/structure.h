#pragma once
// The Cleap arrays (sections 2.3 and 4.2): vertices, triangles and edges that know each other, the table of the triangles at a
// vertex, and the arrays beside them. Numbers are signed: -1 is nobody, as in the text.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "proto/host_device.h"

namespace cordillera::gpu::cleap {

/// The elements of an array of a device, which has room for so many of them.
template <class Array>
auto* room(Array& array, std::size_t count) {
  array.reserve(std::max<std::size_t>(count, 1));
  return array.data();
}

/// A vertex. One that is gone is (INF, heir, heir): the forwarding mark of section 4.6.1. Doubles hold any heir exactly.
struct Position {
  double x = 0, y = 0, z = 0;
};

/// Section 2.3. a, b and op are places in the triangles array, three a triangle: place / 3 is the triangle, what stands at the
/// place is the corner. So a corner that changes its name takes nothing with it, which Algorithms 14 and 16 rely on.
struct Edge {
  std::int32_t n[2];   ///< ends; -1: the edge is gone
  std::int32_t a[2];   ///< where n[0] and n[1] stand in the first triangle
  std::int32_t b[2];   ///< likewise in the second; -1: there is none, the edge is on the border
  std::int32_t op[2];  ///< the corner opposite, in the first and in the second triangle
};

/// The sum of squared distances to planes (equation 3.3), about the mesh's origin: upper right of a symmetric matrix.
struct PlaneQuadric {
  double xx = 0, xy = 0, xz = 0, xw = 0, yy = 0, yz = 0, yw = 0, zz = 0, zw = 0, ww = 0;
};

/// Of a tile: what a vertex brings along, whatever its number becomes.
struct Tag {
  std::uint32_t original = 0;  ///< its number in the tile
  float spent = 0;             ///< share of what rims may move that collapses around it have used
  std::uint8_t mark = 0;       ///< proto::VertexMark and PlaceMark bits
};

inline constexpr std::uint32_t kFree = 0xffffffff;  ///< a triangle's flag that nobody holds: the text's -1
inline constexpr std::uint32_t kClosed = 0;         ///< likewise that nobody can take: candidates are counted from 1
inline constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Borrowed; where the steps run.
struct Arrays {
  std::uint32_t vertices = 0, triangles = 0, edges = 0;
  std::uint32_t row_places = 8;     ///< of triangles, in a row of the table
  Position origin;                  ///< quadrics are about it, for the sake of their digits
  Position* vertex = nullptr;       ///< indexed by vertex
  std::int32_t* corner = nullptr;   ///< the triangles array; 0, 0, 0: the triangle is gone
  Edge* edge = nullptr;             ///< indexed by edge
  std::int32_t* table = nullptr;    ///< rows of Figure 4.3: count, continues, triangles
  std::uint8_t* border = nullptr;   ///< indexed by vertex, 1: on the border (Algorithm 8)
  std::uint32_t* flag = nullptr;    ///< the flags array, indexed by triangle
  PlaneQuadric* quadric = nullptr;  ///< indexed by vertex; of metrics that want them
  /// Ours: the three edges of a triangle. Only for repairs that go no farther than the candidate's vicinity; null otherwise.
  std::int32_t* edge_of = nullptr;
  /// Of a tile (half_edge.h), indexed by vertex; null: any other mesh.
  Tag* tag = nullptr;
  double inverse_rim = 0;  ///< 1 / units that rims may move

  CORDILLERA_HD std::int32_t* row(std::int32_t v) const { return table + static_cast<std::int64_t>(v) * (row_places + 2); }
  CORDILLERA_HD bool is_gone(std::int32_t v) const { return vertex[v].x == kInfinite; }
};

/// f(triangle) along a vertex' row and those where it continues; stops where f says false. False: it was stopped.
template <class F>
CORDILLERA_HD bool all_triangles_at(const Arrays& mesh, std::int32_t v, const F& f) {
  for (std::int32_t at = v; at >= 0;) {
    const std::int32_t* const row = mesh.row(at);
    for (std::int32_t k = 0; k < row[0]; ++k) {
      if (!f(row[2 + k])) return false;
    }
    at = row[1];
  }
  return true;
}

/// I(v) of equation 4.1.
CORDILLERA_HD inline std::int32_t triangles_at(const Arrays& mesh, std::int32_t v) {
  std::int32_t count = 0;
  for (std::int32_t at = v; at >= 0; at = mesh.row(at)[1]) count += mesh.row(at)[0];
  return count;
}

CORDILLERA_HD inline bool is_gone_triangle(const std::int32_t* corner) {
  return corner[0] == 0 && corner[1] == 0 && corner[2] == 0;
}

/// getVertices of Algorithm 5: the ends, and the corners opposite; the last is -1 on the border.
struct Diamond {
  std::int32_t v1, v2, op1, op2;
};
CORDILLERA_HD inline Diamond diamond_of(const Arrays& mesh, const Edge& edge) {
  return {edge.n[0], edge.n[1], mesh.corner[edge.op[0]], edge.op[1] < 0 ? -1 : mesh.corner[edge.op[1]]};
}

/// The Shontz-Nistor vicinity (Figure 3.6): the triangles at the ends and at the corners opposite. Stops where f says false.
template <class F>
CORDILLERA_HD bool all_in_vicinity(const Arrays& mesh, const Edge& edge, const F& f) {
  const Diamond diamond = diamond_of(mesh, edge);
  return all_triangles_at(mesh, diamond.v1, f) && all_triangles_at(mesh, diamond.v2, f) &&
         all_triangles_at(mesh, diamond.op1, f) && (diamond.op2 < 0 || all_triangles_at(mesh, diamond.op2, f));
}

CORDILLERA_HD inline Position middle(const Position& p, const Position& q) {
  return {(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2};
}

}  // namespace cordillera::gpu::cleap
