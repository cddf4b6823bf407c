#pragma once
// Points become vertices, and lines between them edges, in a mesh that is refined. Refinement alone includes it.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "gpu/refine/refinement.h"
#include "gpu/refine/side_points.h"

namespace cordillera::gpu {

inline std::optional<std::uint32_t> vertex_at(const proto::TileMesh& mesh, const MeshPoint& p) {
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    if (mesh.x[v] == p.x && mesh.y[v] == p.y) return v;
  }
  return std::nullopt;
}

class EdgeMaker : public Refinement {
 public:
  using Refinement::Refinement;

 protected:
  static constexpr std::size_t kMostTurns = 256;  ///< of edges that cross one that is to be there

  // The vertex at p, which becomes one if there is none. t: a triangle near it.
  std::optional<std::uint32_t> make_vertex(Id t, const MeshPoint& p) {
    for (int k = 0; k < 4; ++k) {  // to make room, the triangle itself may be turned first
      if (const auto v = vertex_at(mesh_, p)) return is_void(*v) ? std::nullopt : v;
      const Id at = triangle_with(p, t);
      if (at == kNone || !(split_rim(at, p) || split(at, p))) return std::nullopt;
    }
    return std::nullopt;
  }
  // Where p lies on an edge of t beyond which the mesh ends, and which is on no side of the tile.
  bool split_rim(Id t, const MeshPoint& p) {
    const Triangle c = mesh_.triangles[t];
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t a = c[k], b = c[after(k)], opposite = c[before(k)];
      if (across_[t][k] != kNone || twice_area(point(a), point(b), p) != 0) continue;
      if (lie_on_a_side(mesh_, point(a), point(b)) || !has_room(opposite)) return false;
      const Id beyond = across_[t][after(k)], before_it = across_[t][before(k)];
      const std::uint32_t v = append(p, 3);
      const Id u = add();
      set(t, {a, v, opposite}, {kNone, u, before_it});
      set(u, {v, b, opposite}, {kNone, beyond, t});
      relink(beyond, t, u);
      ++valence_[opposite];
      settle_vertex(v, {t, u});
      return true;
    }
    return false;
  }
  // The ends of the edge on a side of the tile that passes p, which is no corner of it.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> edge_of_side(const MeshPoint& p) const {
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      for (unsigned k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh_.triangles[t][k], w = mesh_.triangles[t][after(k)];
        const MeshPoint a = point(v), b = point(w);
        if (across_[t][k] != kNone || !lie_on_a_side(mesh_, a, b) || !lie_on_a_side(mesh_, a, p) || !lie_on_a_side(mesh_, b, p))
          continue;
        if (is_between(p, a, b)) return std::pair{v, w};
      }
    }
    return std::nullopt;
  }

  bool do_cross(std::uint32_t u, std::uint32_t w, std::uint32_t a, std::uint32_t b) const {
    const auto side = [](std::int64_t area) { return area > 0 ? 1 : area < 0 ? -1 : 0; };
    return side(area(a, b, u)) * side(area(a, b, w)) < 0 && side(area(u, w, a)) * side(area(u, w, b)) < 0;
  }
  // Of t, the edge from corner k.
  bool crosses(Id t, unsigned k, std::uint32_t a, std::uint32_t b) const {
    return do_cross(mesh_.triangles[t][k], mesh_.triangles[t][after(k)], a, b);
  }
  // A box around t meets one around a - b.
  bool is_beside(Id t, std::uint32_t a, std::uint32_t b) const {
    const auto& [u, v, w] = mesh_.triangles[t];
    const auto meet = [&](const std::vector<std::int32_t>& at) {
      return std::max({at[u], at[v], at[w]}) >= std::min(at[a], at[b]) &&
             std::min({at[u], at[v], at[w]}) <= std::max(at[a], at[b]);
    };
    return meet(mesh_.x) && meet(mesh_.y);
  }
  // The edge a - b, by turning those that cross it (S. W. Sloan, "A fast algorithm for generating constrained Delaunay
  // triangulations", 1993).
  bool make_edge(std::uint32_t a, std::uint32_t b) {
    std::vector<Id> between;  // turned edges cross it within these
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      if (is_beside(t, a, b) && (crosses(t, 0, a, b) || crosses(t, 1, a, b) || crosses(t, 2, a, b))) between.push_back(t);
    }
    for (std::size_t turns = 0; turns < kMostTurns; ++turns) {
      std::vector<Quad> crossing, clearing;  // convex ones; those whose other diagonal is out of the way
      bool crossed = false;
      for (const Id t : between) {
        for (unsigned k = 0; k < 3; ++k) {
          Quad q;
          if (!crosses(t, k, a, b)) continue;
          crossed = true;
          if (!can_flip(t, k, q, 0)) continue;
          crossing.push_back(q);
          if (!do_cross(q.c, q.d, a, b)) clearing.push_back(q);
        }
      }
      if (!crossed) return true;
      if (crossing.empty()) return false;
      flip(turned(clearing.empty() ? crossing[turns % crossing.size()]
                                   : clearing.front()));  // another one each time, not one back and forth
    }
    return false;
  }
};

}  // namespace cordillera::gpu
