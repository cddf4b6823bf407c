#pragma once
// Edges of a tile: one end goes, the other stays where it is, so positions stay on the lattice. The border stays, holes keep
// their rims within what rims may move.
#include "gpu/cleap/quadric.h"
#include "gpu/mesh/valence_limits.h"
#include "proto/mesh.h"

namespace cordillera::gpu::cleap {

/// Vertex marks beyond proto::VertexMark.
enum PlaceMark : std::uint8_t {
  kOnSide = 8,     ///< on the border of the mesh: open fan
  kOnCorner = 16,  ///< a corner of it
};

/// Which end stays; -1: neither may go.
struct HalfEdge {
  std::int32_t stays = -1;
  double cost = kInfinite;
  float spent = 0;  ///< share of what rims may move that is used up around it
};

/// By its marks: triangles that a collapse may leave at a vertex. A fan on a side has a triangle less than neighbours.
CORDILLERA_HD inline std::int32_t most_triangles_of(std::uint8_t mark) {
  if (mark & kOnSide) return ((mark & kOnCorner) ? kCornerValence : kSideValence) - 1;
  return (mark & proto::kVoid) ? kVoidValence : kInnerValence;
}

CORDILLERA_HD inline double distance2(const Position& p, const Position& q) {
  return (p.x - q.x) * (p.x - q.x) + (p.y - q.y) * (p.y - q.y);
}
/// In the plan, of p from the line between q and r that ends there.
CORDILLERA_HD inline double distance_from_segment(const Position& p, const Position& q, const Position& r) {
  const double ex = r.x - q.x, ey = r.y - q.y, along = (p.x - q.x) * ex + (p.y - q.y) * ey, length2 = ex * ex + ey * ey;
  if (along <= 0) return sqrt(distance2(p, q));
  if (along >= length2) return sqrt(distance2(p, r));
  const double area = (p.x - q.x) * ey - (p.y - q.y) * ex;
  return (area < 0 ? -area : area) / sqrt(length2);
}

/// What lies around the end that goes.
struct Departure {
  const Arrays& mesh;
  std::int32_t from, to;
  bool any_void = false, any_void_neighbour = false, any_published = false;

  CORDILLERA_HD Departure(const Arrays& arrays, std::int32_t goes, std::int32_t stays) : mesh(arrays), from(goes), to(stays) {
    all_triangles_at(mesh, from, [&](std::int32_t triangle) {
      bool published = true;
      for (int k = 0; k < 3; ++k) {
        const std::int32_t v = mesh.corner[3 * triangle + k];
        if (!has(v, proto::kVoid)) continue;
        published = false;
        any_void = true;
        if (v != from) any_void_neighbour = true;
      }
      any_published = any_published || published;
      return true;
    });
  }

  CORDILLERA_HD bool has(std::int32_t v, std::uint8_t mark) const { return (mesh.tag[v].mark & mark) != 0; }

  /// Labels decide, and what has to stay.
  CORDILLERA_HD bool is_allowed() const {
    if (has(from, proto::kKeep)) return false;
    if (has(from, proto::kVoid)) return has(to, proto::kVoid) || !any_void_neighbour;  // the last of a hole may close it
    if (!any_void || !any_published) return true;
    return !is_on_rim() || is_rim(to);
  }

  /// How far rims move: those that end here swing to the end that stays; a hole that closes moves by its radius.
  CORDILLERA_HD double rim_deviation() const {
    if (!any_void) return 0;
    const bool closes = has(from, proto::kVoid);
    if (closes && has(to, proto::kVoid)) return 0;
    double most = 0;
    each_neighbour([&](std::int32_t v) {
      double distance = 0;
      if (closes)
        distance = sqrt(distance2(mesh.vertex[from], mesh.vertex[v]));
      else if (v != to && is_rim(v))
        distance = distance_from_segment(mesh.vertex[from], mesh.vertex[to], mesh.vertex[v]);
      if (distance > most) most = distance;
    });
    return most;
  }

 private:
  template <class F>
  CORDILLERA_HD void each_neighbour(const F& f) const {
    all_triangles_at(mesh, from, [&](std::int32_t triangle) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t v = mesh.corner[3 * triangle + k];
        if (v != from) f(v);
      }
      return true;
    });
  }
  /// One of the edge's triangles is published and the other, or none, is not.
  CORDILLERA_HD bool is_rim(std::int32_t v) const {
    if (has(v, proto::kVoid)) return false;
    int published = 0;
    all_triangles_at(mesh, from, [&](std::int32_t triangle) {
      const std::int32_t* const corner = mesh.corner + 3 * triangle;
      if ((corner[0] == v || corner[1] == v || corner[2] == v) && !is_void(mesh, triangle)) ++published;
      return true;
    });
    return published == 1;
  }
  CORDILLERA_HD bool is_on_rim() const {
    bool any = false;
    each_neighbour([&](std::int32_t v) { any = any || is_rim(v); });
    return any;
  }
};

/// The cheaper way of those that are allowed; of equals, the first end stays.
CORDILLERA_HD inline HalfEdge best_half_edge(const Arrays& mesh, const Edge& edge) {
  constexpr double kShort = 1e-9;  // among equals, the shortest edge
  HalfEdge best;
  for (int k = 0; k < 2; ++k) {
    const std::int32_t to = edge.n[k], from = edge.n[1 - k];
    const Departure departure(mesh, from, to);
    if (!departure.is_allowed()) continue;
    const auto rim = static_cast<float>(departure.rim_deviation() * mesh.inverse_rim);
    const float spent = mesh.tag[from].spent + rim;
    if (!(spent <= 1)) continue;
    double cost = kShort * distance2(mesh.vertex[from], mesh.vertex[to]);
    if (!departure.any_published)
      cost = 0;
    else
      cost += value(sum(mesh.quadric[from], mesh.quadric[to]), mesh.origin, mesh.vertex[to]);
    if (cost < best.cost) best = {to, cost, spent};
  }
  return best;
}

/// The metric of tiles: Algorithm 1's quadrics at the end that stays. Not among AllMetrics, for it wants tags.
struct QuadricOnTile {
  static constexpr bool kQuadrics = true;
  CORDILLERA_HD static Position place(const Arrays& mesh, const Edge& edge) {
    const std::int32_t stays = best_half_edge(mesh, edge).stays;
    return mesh.vertex[stays < 0 ? edge.n[0] : stays];
  }
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) { return best_half_edge(mesh, edge).cost; }
};

}  // namespace cordillera::gpu::cleap
