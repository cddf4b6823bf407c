#pragma once
// What refine_stuck() tries where a triangle is wished for. Nothing else includes it.
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <optional>
#include <vector>

#include "gpu/refine/edge_maker.h"
#include "gpu/refine/refine.h"
#include "gpu/refine/side_points.h"

namespace cordillera::gpu {

inline bool lacks_data(const std::array<MeshPoint, 3>& corners) {
  return std::any_of(corners.begin(), corners.end(), [](const MeshPoint& p) { return p.height == proto::kNoHeight; });
}
/// In any order.
inline bool are_corners(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                        const std::array<MeshPoint, 3>& points) {
  return std::all_of(points.begin(), points.end(), [&](const MeshPoint& p) {
    return std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return mesh.x[v] == p.x && mesh.y[v] == p.y; });
  });
}

/// One triangle that is wished for, made.
class Making : EdgeMaker {
 public:
  static constexpr std::uint32_t kCrowd = 4;  ///< neighbours more than its valence allows that a vertex has for a while

  /// crowd: neighbours more than its valence allows that a vertex may have while what came of a triangle is refined.
  Making(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::uint32_t crowd)
      : EdgeMaker(mesh, meter, limit_m, kCrowd), refining_crowd_(crowd), first_valence_(valence_) {}

  /// Makes these points vertices and the lines between them edges, which neighbours on the lattice can always be, and refines
  /// what that has left over the limit. False: some is left, or a vertex has too many neighbours.
  bool make_triangle(Id t, const std::array<MeshPoint, 3>& corners) {
    if (lacks_data(corners)) return take_off_rim(t) || take_off_beyond(t, corners) || make_rim(t, corners);
    return make(t, corners) && finish(t);
  }
  /// Likewise a corner inside the tile, and the ends of the edge that passes another one on the tile's side. False also where a
  /// vertex is there.
  bool make_triangle_on_side(Id t, const MeshPoint& inside, const MeshPoint& on_side) {
    if (vertex_at(mesh_, on_side)) return false;
    const auto edge = edge_of_side(on_side);
    if (!edge) return false;
    const std::optional<std::uint32_t> v = make_vertex(t, inside);
    return v && make_edge(*v, edge->first) && make_edge(*v, edge->second) && finish(t);
  }
  /// Likewise those of its points that can be vertices, where others lie beyond the mesh or on the tile's side, and the edges
  /// between them.
  bool make_part(Id t, const std::array<MeshPoint, 3>& corners) {
    std::vector<std::uint32_t> made;
    for (const MeshPoint& p : corners) {
      if (p.height == proto::kNoHeight) continue;
      if (const std::optional<std::uint32_t> v = make_vertex(t, p)) made.push_back(*v);
    }
    for (std::size_t k = 0; k + 1 < made.size(); ++k) {
      if (!make_edge(made[k], made[k + 1])) return false;
    }
    return result_.inserted > 0 && finish(t);
  }
  /// Those of its points that have data, where a triangle on the rim shows what has none: then that part of it may be taken off.
  bool make_rim(Id t, const std::array<MeshPoint, 3>& corners) {
    crowd_ = kCrowd;
    for (const MeshPoint& p : corners) {
      if (p.height != proto::kNoHeight) make_vertex(t, p);
    }
    if (result_.inserted == 0 || !finish(t, Left::rim)) return false;
    for (Id u = 0; u < mesh_.triangles.size(); ++u) {
      if (known_[u] && is_over(u)) slivers_.push_back(u);
    }
    return true;
  }
  /// Where no sample lies in it nor on the edge that is on the rim, so none is uncovered.
  bool take_off_rim(Id t) {
    crowd_ = 0;
    for (unsigned k = 0; k < 3 && is_smallest(t); ++k) {
      Quad q;
      if (!is_on_rim(t, k, q) || !covers(across_[t][after(k)]) || !covers(across_[t][before(k)])) continue;
      flip(turned(q));
      return true;
    }
    if (!is_sliver(t)) return false;
    taken_off_ = t;
    return true;
  }
  /// Likewise one between it and a point without data: one after the other, until it is on the rim itself.
  bool take_off_beyond(Id t, const std::array<MeshPoint, 3>& corners) {
    const MeshPoint empty = *std::ranges::find(corners, proto::kNoHeight, &MeshPoint::height);
    for (int steps = 0; steps < kMostWalked; ++steps) {
      unsigned k = 0;
      while (k < 3 && twice_area(point(mesh_.triangles[t][k]), point(mesh_.triangles[t][after(k)]), empty) >= 0) ++k;
      if (k == 3 || across_[t][k] == kNone) return false;
      t = across_[t][k];
      if (!is_sliver(t)) continue;
      taken_off_ = t;
      return true;
    }
    return false;
  }
  /// Likewise, where the mesh ends, a needle whose corner is all but on the rim.
  bool take_off_needle(Id t) {
    const Triangle& c = mesh_.triangles[t];
    const std::optional<unsigned> k = edge_where_mesh_ends(t);
    if (!k || !is_smallest(t) || !all_but_on(point(c[*k]), point(c[after(*k)]), point(c[before(*k)]))) return false;
    taken_off_ = t;
    return true;
  }
  /// What make_rim has left over the limit, to be taken off.
  const std::vector<Id>& slivers() const { return slivers_; }
  /// The triangle that was taken off the rim.
  std::optional<Id> taken_off() const { return taken_off_; }
  /// A point of the tile's side that had to be a vertex for a triangle that another one asked for.
  std::optional<MeshPoint> missing_on_side() const { return missing_on_side_; }
  /// Why nothing was made: a point could not be a vertex, or a vertex has too many neighbours.
  bool lacks_vertex() const { return lacks_vertex_; }
  bool is_crowded() const { return is_crowded_; }

 private:
  static constexpr std::size_t kMostCrowded = 16;  ///< points that go in there at a time
  static constexpr int kMostWalked = 8;            ///< from a triangle to the rim
  static constexpr int kMostMore = 4;              ///< triangles that one made along a wall may ask for, too
  enum class Left { nothing, rim };                // that may be left over the limit

  bool is_smallest(Id t) const {
    const Triangle& c = mesh_.triangles[t];
    return area(c[0], c[1], c[2]) == 1;
  }
  // May go from the rim. Of the samples on its sides none lies between the ends of the one beyond which the mesh ends, and none
  // within it (G. Pick's theorem, 1899). Or it is a smallest one that hangs on by one side: the sample at its tip is all but
  // alone.
  bool is_sliver(Id t) const {
    const Triangle& c = mesh_.triangles[t];
    const auto steps = [&](unsigned corner) {
      const MeshPoint a = point(c[corner]), b = point(c[after(corner)]);
      return std::gcd(b.x - a.x, b.y - a.y);
    };
    const std::optional<unsigned> k = edge_where_mesh_ends(t);
    if (k) return steps(*k) == 1 && area(c[0], c[1], c[2]) == steps(after(*k)) + steps(before(*k)) - 1;
    return is_smallest(t) && std::count(across_[t].begin(), across_[t].end(), kNone) == 2 && !touches_tile_side(t);
  }
  bool touches_tile_side(Id t) const {
    const Triangle& c = mesh_.triangles[t];
    return std::any_of(c.begin(), c.end(), [&](std::uint32_t v) { return is_on_side(mesh_, point(v)); });
  }
  bool covers(Id t) const { return t != kNone && published(mesh_.triangles[t]); }
  // The one edge of t beyond which the mesh ends, on no side of the tile. None also where the corner opposite is on the rim, too:
  // it would be left with two fans.
  std::optional<unsigned> edge_where_mesh_ends(Id t) const {
    if (std::count(across_[t].begin(), across_[t].end(), kNone) != 1) return std::nullopt;
    const auto k = static_cast<unsigned>(std::find(across_[t].begin(), across_[t].end(), kNone) - across_[t].begin());
    const Triangle& c = mesh_.triangles[t];
    if (lie_on_a_side(mesh_, point(c[k]), point(c[after(k)]))) return std::nullopt;
    const std::uint32_t opposite = c[before(k)];
    const Id first = first_around(t, opposite);
    return across_[first][corner_of(first, opposite)] == kNone ? std::nullopt : std::optional(k);
  }

  bool make(Id t, const std::array<MeshPoint, 3>& corners) {
    std::array<std::uint32_t, 3> v{};
    for (unsigned k = 0; k < 3; ++k) {
      const std::optional<std::uint32_t> made = make_vertex(t, corners[k]);
      if (!made && is_on_side(mesh_, corners[k]) && !vertex_at(mesh_, corners[k])) missing_on_side_ = corners[k];
      if (!made) {
        lacks_vertex_ = true;
        return false;
      }
      v[k] = *made;
    }
    return make_edge(v[0], v[1]) && make_edge(v[1], v[2]) && make_edge(v[2], v[0]);
  }

  // What making a triangle has left over the limit, and neighbours that are too many. Along a wall each triangle that is made may
  // leave the next one over it, which is made then. t: may be as it was, when all was there already.
  bool finish(Id t, Left may_be_left = Left::nothing) {
    for (int more = 0;; ++more) {
      std::vector<Id> changed{t};
      for (Id u = 0; u < mesh_.triangles.size(); ++u) {
        if (stamp_[u] > 0 && u != t) changed.push_back(u);
      }
      crowd_ = refining_crowd_;
      run(changed, kMostCrowded);
      crowd_ = kCrowd;
      const std::optional<Id> worst = worst_over(may_be_left);
      if (!worst) return disperse();
      if (more == kMostMore) return false;
      const Triangle& c = mesh_.triangles[*worst];
      const auto wanted = meter_.wanted({point(c[0]), point(c[1]), point(c[2])}, limit_m_);
      if (!wanted || lacks_data(*wanted) || are_corners(mesh_, c, *wanted) || !make(*worst, *wanted)) return false;
    }
  }

  // Of the triangles that were measured and are over the limit, but for slivers where these may be left.
  std::optional<Id> worst_over(Left may_be_left) {
    std::optional<Id> worst;
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      if (!known_[t] || !is_over(t) || (may_be_left == Left::rim && is_sliver(t))) continue;
      if (!worst || error_[t].error_m > error_[*worst].error_m) worst = t;
    }
    return worst;
  }

  // Turns edges until no vertex has more neighbours than it may have without a crowd, or than it had. False: that could not be
  // done.
  bool disperse() {
    crowd_ = 0;
    for (std::uint32_t v = 0; v < valence_.size(); ++v) {
      const std::uint32_t most = std::max(cap(v), v < first_valence_.size() ? first_valence_[v] : 0);
      while (valence_[v] > most) {
        if (take_neighbour(v)) continue;
        is_crowded_ = true;
        return false;
      }
    }
    return true;
  }
  // Takes a neighbour from v where both triangles stay within the limit.
  bool take_neighbour(std::uint32_t v) {
    std::optional<Turned> best;
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& c = mesh_.triangles[t];
      if (c[0] == v || c[1] == v || c[2] == v) prefer_edge(t, corner_of(t, v), best);
    }
    if (!best || best->greater_m() > limit_m_) return false;
    flip(*best);
    return true;
  }

  const std::uint32_t refining_crowd_;
  const std::vector<std::uint32_t> first_valence_;  ///< indexed by vertex that was there
  std::optional<Id> taken_off_;
  std::vector<Id> slivers_;
  std::optional<MeshPoint> missing_on_side_;
  bool lacks_vertex_ = false, is_crowded_ = false;
};

}  // namespace cordillera::gpu
