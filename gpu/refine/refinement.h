#pragma once
// The steps that refine() and refine_stuck() are made of. Nothing else includes it.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "gpu/refine/measured_mesh.h"

namespace cordillera::gpu {

class Refinement : public MeasuredMesh {
 public:
  using MeasuredMesh::MeasuredMesh;

  /// As refine() says.
  Refined run(std::span<const Id> over, std::size_t most) {
    for (const Id t : over) queue(t);
    while (!worst_.empty() && result_.inserted < most) {
      const auto [error_m, t, stamp] = worst_.top();
      worst_.pop();
      if (stamp != stamp_[t]) continue;
      const std::uint32_t before = result_.inserted + result_.flipped;
      insert(t);
      // What went in beside it may have left it as it was.
      if (stamp == stamp_[t] && result_.inserted + result_.flipped > before) queue(t);
    }
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      if (known_[t] && error_[t].error_m > limit_m_) ++result_.over;
    }
    return result_;
  }

 protected:
  static constexpr std::uint32_t kReserve = 2;  ///< places at a vertex that edges turned for shape leave to insertions
  /// At a vertex: edges turned to make room, or away from needles, might turn back for ever. Between walls that nothing mends all
  /// of them are spent: with 32 a raster of nothing but walls took twice the time, and no mesh was better.
  static constexpr int kMostHarms = 8;

  struct Entry {
    double error_m;
    Id triangle;
    std::uint32_t stamp;
    bool operator<(const Entry& other) const {  // worst first; among equals the lowest triangle
      return std::tuple(error_m, other.triangle) < std::tuple(other.error_m, triangle);
    }
  };

  void queue(Id t) {
    if (is_over(t)) worst_.push({error(t).error_m, t, stamp_[t]});
  }

  void insert(Id t) {
    if (shed_needle(t)) return;
    const TriangleError found = error(t);
    for (int k = 0; k < found.count; ++k) {
      const MeshPoint& p = found.points[static_cast<std::size_t>(k)];
      const Id at = triangle_with(p, t);
      if (at != kNone && split(at, p)) return;
    }
    turn_edge_of(t);
  }

  bool split(Id t, const MeshPoint& p) {
    const Triangle c = mesh_.triangles[t];
    for (unsigned k = 0; k < 3; ++k) {
      if (twice_area(point(c[k]), point(c[after(k)]), p) != 0) continue;
      return split_edge(t, k, p);
    }
    return split_inside(t, p);
  }

  bool split_inside(Id t, const MeshPoint& p) {
    const std::uint32_t stamp = stamp_[t];
    const Triangle corners = mesh_.triangles[t];
    for (const std::uint32_t v : corners) {
      if (has_room(v)) continue;
      make_room_at(t, v, corners);
      if (stamp_[t] != stamp) return true;  // the triangle itself was turned: it is queued again
      if (!has_room(v)) return split_beside(t, corner_of(t, v), p);
    }
    const Triangle c = mesh_.triangles[t];
    const std::array<Id, 3> beyond = across_[t];
    const std::uint32_t v = append(p, 3);
    const Id t1 = add(), t2 = add();
    set(t, {c[0], c[1], v}, {beyond[0], t1, t2});
    set(t1, {c[1], c[2], v}, {beyond[1], t2, t});
    set(t2, {c[2], c[0], v}, {beyond[2], t, t1});
    relink(beyond[1], t, t1);
    relink(beyond[2], t, t2);
    for (const std::uint32_t corner : c) ++valence_[corner];
    settle_vertex(v, {t, t1, t2});
    return true;
  }

  // Corner k is full for good: an edge there ends at p instead, as if p lay on it, which gives the corner no neighbour more.
  bool split_beside(Id t, unsigned k, const MeshPoint& p) {
    for (const unsigned edge : {k, before(k)}) {
      const Id u = across_[t][edge];
      if (u == kNone || !published(mesh_.triangles[u])) continue;
      const MeshPoint a = point(mesh_.triangles[t][edge]), b = point(mesh_.triangles[t][after(edge)]), d = point(opposite(u, t));
      if (twice_area(b, p, d) > 0 && twice_area(p, a, d) > 0 && split_edge(t, edge, p)) return true;
    }
    return false;
  }

  // p: on edge k of t, or inside t and so close to it that all four triangles have area.
  bool split_edge(Id t, unsigned k, const MeshPoint& p) {
    const Id u = across_[t][k];
    if (u == kNone) return false;
    const std::uint32_t a = mesh_.triangles[t][k], b = mesh_.triangles[t][after(k)], c = mesh_.triangles[t][before(k)];
    const unsigned j = corner_of(u, b);  // u runs b -> a, then d
    const std::uint32_t d = mesh_.triangles[u][before(j)];
    const std::uint32_t stamp = stamp_[t], stamp_u = stamp_[u];
    for (const auto& [at, v] : {std::pair{t, c}, std::pair{u, d}}) {
      if (has_room(v)) continue;
      make_room_at(at, v, {c, d, d});
      if (stamp_[t] != stamp) return true;
      if (stamp_[u] != stamp_u || !has_room(v)) return false;
    }
    const Id bc = across_[t][after(k)], ca = across_[t][before(k)], ad = across_[u][after(j)], db = across_[u][before(j)];
    const std::uint32_t v = append(p, 4);
    const Id t1 = add(), u1 = add();
    set(t, {a, v, c}, {u1, t1, ca});
    set(t1, {v, b, c}, {u, bc, t});
    set(u, {b, v, d}, {t1, u1, db});
    set(u1, {v, a, d}, {t, ad, u});
    relink(bc, t, t1);
    relink(ad, u, u1);
    ++valence_[c];
    ++valence_[d];
    settle_vertex(v, {t, t1, u, u1});
    return true;
  }

  // Turns edges opposite a new vertex while that pays, and queues what is over the limit.
  void settle_vertex(std::uint32_t v, std::vector<Id> around) {
    std::vector<Id> open = around;
    while (!open.empty()) {
      const Id t = open.back();
      open.pop_back();
      Quad q;
      if (!can_flip(t, after(corner_of(t, v)), q, kReserve)) continue;
      const std::optional<double> bound_m = bound_for(q);
      if (!bound_m || !stays_below(q, *bound_m)) continue;
      flip(turned(q));
      open.push_back(q.t);
      open.push_back(q.u);
      around.push_back(q.u);
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    for (const Id t : around) queue(t);
  }

  void flip_and_queue(const Turned& now) {
    flip(now);
    queue(now.q.t);
    queue(now.q.u);
  }
  // Counts one harm more at v. Insertions repair harm, but not for ever: false once v has had all of its own.
  bool spend_harm(std::uint32_t v) { return ++harmed_[v] <= kMostHarms; }

  // The edge from corner k of t, if turning it does less harm than best and makes no needle.
  void prefer_edge(Id t, unsigned k, std::optional<Turned>& best) const {
    Quad q;
    if (!can_flip(t, k, q, 0) || makes_needle(q)) return;
    const Turned now = turned(q);
    if (!best || now.greater_m() < best->greater_m()) best = now;
  }

  bool shed_needle(Id t) {
    for (unsigned k = 0; k < 3; ++k) {
      Quad q;
      if (!can_shed_needle(t, k, q)) continue;
      flip_and_queue(turned(q));
      return true;
    }
    return false;
  }

  // No corner more would help: a sliver, which rounding tilts. Turns the edge of it that does least harm.
  void turn_edge_of(Id t) {
    std::optional<Turned> best;
    for (unsigned k = 0; k < 3; ++k) prefer_edge(t, k, best);
    if (best && (best->greater_m() < error(t).error_m || spend_harm(mesh_.triangles[t][0]))) flip_and_queue(*best);
  }

  // Takes a neighbour from v, a corner of t that is over the limit: turns the edge at v that does least harm. waiting: vertices
  // that must have room for one neighbour more afterwards.
  void make_room_at(Id t, std::uint32_t v, const Triangle& waiting) {
    const auto in_the_way = [&](std::uint32_t w) {
      return std::find(waiting.begin(), waiting.end(), w) != waiting.end() && !has_room(w, 1);
    };
    const Id start = first_around(t, v);
    std::optional<Turned> best;
    t = start;
    do {
      const unsigned k = corner_of(t, v);
      const Id u = across_[t][k];
      const bool blocked = u == kNone || in_the_way(mesh_.triangles[t][before(k)]) || in_the_way(opposite(u, t));
      if (!blocked) prefer_edge(t, k, best);
      t = across_[t][before(k)];  // counter-clockwise around v
    } while (t != kNone && t != start);
    if (best && spend_harm(v)) flip_and_queue(*best);
  }

  std::map<std::uint32_t, int> harmed_;  // indexed by vertex: edges turned there to make room
  std::priority_queue<Entry> worst_;
};

}  // namespace cordillera::gpu
