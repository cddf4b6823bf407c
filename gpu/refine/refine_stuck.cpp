#include <algorithm>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "gpu/refine/refine.h"
#include "gpu/refine/refinement.h"
#include "gpu/refine/side_points.h"

namespace cordillera::gpu {
namespace {

constexpr std::uint32_t kCrowd = 4;       // neighbours more than its valence allows that a vertex has for a while
constexpr std::size_t kMostCrowded = 16;  // points that go in there at a time
constexpr std::size_t kMostTurns = 256;   // of edges that cross one that is to be there
constexpr int kMostWalked = 8;            // from a triangle to the rim
constexpr int kMostMore = 4;              // triangles that one made along a wall may ask for, too

bool lacks_data(const std::array<MeshPoint, 3>& corners) {
  return std::any_of(corners.begin(), corners.end(), [](const MeshPoint& p) { return p.height == proto::kNoHeight; });
}
/// In any order.
bool are_corners(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle,
                 const std::array<MeshPoint, 3>& points) {
  return std::all_of(points.begin(), points.end(), [&](const MeshPoint& p) {
    return std::any_of(triangle.begin(), triangle.end(), [&](std::uint32_t v) { return mesh.x[v] == p.x && mesh.y[v] == p.y; });
  });
}

std::optional<std::uint32_t> vertex_at(const proto::TileMesh& mesh, const MeshPoint& p) {
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    if (mesh.x[v] == p.x && mesh.y[v] == p.y) return v;
  }
  return std::nullopt;
}

/// One triangle that is wished for, made.
class Making : Refinement {
 public:
  /// crowd: neighbours more than its valence allows that a vertex may have while what came of a triangle is refined.
  Making(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::uint32_t crowd)
      : Refinement(mesh, meter, limit_m, kCrowd), refining_crowd_(crowd), first_valence_(valence_) {}

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
  enum class Left { nothing, rim };  // that may be left over the limit

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

}  // namespace

Refined refine_stuck(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over) {
  Refined all;
  std::vector<Refinement::Id> left(over.rbegin(), over.rend());
  while (!left.empty()) {
    const Refinement::Id t = left.back();
    left.pop_back();
    const Refinement::Triangle& c = mesh.triangles[t];
    const auto point = [&](std::uint32_t v) { return MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
    const auto wanted = meter.wanted({point(c[0]), point(c[1]), point(c[2])}, limit_m);
    if (!wanted) continue;
    if (are_corners(mesh, c, *wanted)) {  // rounded points tilt it, and nothing helps
      ++all.over;
      continue;
    }
    std::optional<Refinement::Id> off;
    std::vector<Refinement::Id> slivers;
    std::optional<MeshPoint> missing;
    bool lacks_vertex = false, is_crowded = false;
    const auto made = [&](const auto& make, std::uint32_t crowd = kCrowd) {
      proto::TileMesh trial = mesh;
      Making making(trial, meter, limit_m, crowd);
      if (!make(making)) {
        if (making.missing_on_side()) missing = making.missing_on_side();
        lacks_vertex = lacks_vertex || making.lacks_vertex(), is_crowded = is_crowded || making.is_crowded();
        return false;
      }
      all.inserted += static_cast<std::uint32_t>(trial.vertices() - mesh.vertices());
      off = making.taken_off();
      slivers = making.slivers();
      mesh = std::move(trial);
      return true;
    };
    const auto make_triangle = [&](Making& making) { return making.make_triangle(t, *wanted); };
    // A crowd may be in a place from which no edge can be turned away.
    bool done = made(make_triangle) || (is_crowded && made(make_triangle, 0));
    // Else with two corners on a side of the tile, whose vertices are not to be changed.
    for (const std::size_t step : {1, 2}) {
      for (std::size_t k = 0; k < 3 && !done; ++k) {
        const MeshPoint &inside = (*wanted)[k], &on_side = (*wanted)[(k + step) % 3];
        if (inside.height == proto::kNoHeight || is_on_side(mesh, inside) || !is_on_side(mesh, on_side)) continue;
        done = made([&](Making& making) { return making.make_triangle_on_side(t, inside, on_side); });
      }
    }
    // Or as much of it as does not lie beyond the mesh; a needle along the rim goes.
    if (!done && lacks_vertex) done = made([&](Making& making) { return making.make_part(t, *wanted); });
    if (!done && lacks_vertex) done = made([&](Making& making) { return making.take_off_needle(t); });
    if (!done) {
      ++all.over;
      if (missing) all.on_sides.push_back(*missing);
      for (const MeshPoint& p : *wanted) {
        if (p.height != proto::kNoHeight && is_on_side(mesh, p) && !vertex_at(mesh, p)) all.on_sides.push_back(p);
      }
    }
    if (!off) {
      std::ranges::copy_if(slivers, std::back_inserter(left), [&](Refinement::Id s) { return std::ranges::count(left, s) == 0; });
      continue;
    }
    std::erase(left, *off);
    if (*off != t) left.push_back(t);
    const Refinement::Triangle gone = mesh.triangles[*off];
    const auto last = static_cast<Refinement::Id>(mesh.triangles.size() - 1);
    mesh.triangles[*off] = mesh.triangles[last];
    mesh.triangles.pop_back();
    for (const std::uint32_t v : gone) {
      if (std::none_of(mesh.triangles.begin(), mesh.triangles.end(),
                       [v](const auto& other) { return std::ranges::count(other, v) > 0; }))
        mesh.mark[v] |= proto::kVoid;
    }
    std::replace(left.begin(), left.end(), last, *off);
  }
  return all;
}

}  // namespace cordillera::gpu
