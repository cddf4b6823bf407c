#pragma once
// A mesh while points go in: its triangles, their neighbours and errors, and the steps that refine() and refine_stuck() are made
// of. Nothing else includes it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "gpu/mesh/refine_shape.h"
#include "gpu/mesh/rings.h"
#include "gpu/mesh/triangle_neighbours.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

class Refinement {
 public:
  using Triangle = std::array<std::uint32_t, 3>;
  using Id = std::uint32_t;  ///< of a triangle

  /// crowd: neighbours more than its valence allows that a vertex may have for a while.
  Refinement(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::uint32_t crowd = 0)
      : mesh_(mesh), meter_(meter), limit_m_(limit_m), crowd_(crowd), across_(neighbours(mesh.triangles)) {
    error_.resize(mesh_.triangles.size());
    known_.assign(mesh_.triangles.size(), 0);
    stamp_.assign(mesh_.triangles.size(), 0);
    valence_.assign(mesh_.vertices(), 0);
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      for (unsigned k = 0; k < 3; ++k) {
        ++valence_[mesh_.triangles[t][k]];
        if (across_[t][k] == kNone) ++valence_[mesh_.triangles[t][k]];  // one neighbour more than triangles on the border
      }
    }
  }

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
  static constexpr Id kNone = kNoTriangle;
  static constexpr std::uint32_t kReserve = 2;  ///< places at a vertex that edges turned for shape leave to insertions
  static constexpr int kMostSteps = 64;         ///< of a walk from triangle to triangle
  static constexpr int kMostHarms =
      32;  ///< at a vertex: edges turned to make room, or away from needles, might turn back for ever

  struct Entry {
    double error_m;
    Id triangle;
    std::uint32_t stamp;
    bool operator<(const Entry& other) const {  // worst first; among equals the lowest triangle
      return std::tuple(error_m, other.triangle) < std::tuple(other.error_m, triangle);
    }
  };

  bool is_void(std::uint32_t v) const { return (mesh_.mark[v] & proto::kVoid) != 0; }
  bool published(const Triangle& t) const { return !is_void(t[0]) && !is_void(t[1]) && !is_void(t[2]); }
  std::uint32_t cap(std::uint32_t v) const { return most_neighbours(mesh_, v, kWeldedCaps) + crowd_; }
  bool has_room(std::uint32_t v, std::uint32_t reserve = 0) const { return valence_[v] + reserve < cap(v); }

  MeshPoint point(std::uint32_t v) const { return {mesh_.x[v], mesh_.y[v], mesh_.height[v]}; }
  TriangleError measured(const Triangle& t) const {
    return published(t) ? meter_.measure({point(t[0]), point(t[1]), point(t[2])}, limit_m_) : TriangleError{};
  }
  const TriangleError& error(Id t) {
    if (!known_[t]) {
      error_[t] = measured(mesh_.triangles[t]);
      known_[t] = 1;
    }
    return error_[t];
  }
  bool is_over(Id t) { return error(t).error_m > limit_m_; }
  void queue(Id t) {
    if (is_over(t)) worst_.push({error(t).error_m, t, stamp_[t]});
  }
  void set(Id t, const Triangle& corners, const std::array<Id, 3>& across) {
    mesh_.triangles[t] = corners;
    across_[t] = across;
    known_[t] = 0;
    ++stamp_[t];
  }
  Id add() {
    mesh_.triangles.push_back({});
    across_.push_back({});
    error_.emplace_back();
    known_.push_back(0);
    stamp_.push_back(0);
    return static_cast<Id>(mesh_.triangles.size() - 1);
  }
  void relink(Id t, Id old, Id now) {
    if (t == kNone) return;
    for (Id& other : across_[t])
      if (other == old) {
        other = now;
        return;
      }
  }
  unsigned corner_of(Id t, std::uint32_t v) const {
    const Triangle& c = mesh_.triangles[t];
    return c[0] == v ? 0 : c[1] == v ? 1 : 2;
  }

  std::int64_t area(std::uint32_t a, std::uint32_t b, std::uint32_t c) const { return twice_area(point(a), point(b), point(c)); }

  std::uint32_t append(const MeshPoint& p, std::uint32_t valence) {
    mesh_.x.push_back(p.x);
    mesh_.y.push_back(p.y);
    mesh_.height.push_back(p.height);
    mesh_.mark.push_back(0);
    valence_.push_back(valence);
    ++result_.inserted;
    return static_cast<std::uint32_t>(mesh_.vertices() - 1);
  }

  void insert(Id t) {
    if (shed(t)) return;
    const TriangleError found = error(t);
    for (int k = 0; k < found.count; ++k) {
      const MeshPoint& p = found.points[static_cast<std::size_t>(k)];
      const Id at = triangle_with(p, t);
      if (at != kNone && split(at, p)) return;
    }
    turn(t);
  }

  bool split(Id t, const MeshPoint& p) {
    const Triangle c = mesh_.triangles[t];
    for (unsigned k = 0; k < 3; ++k) {
      if (twice_area(point(c[k]), point(c[after(k)]), p) != 0) continue;
      return split_edge(t, k, p);
    }
    return split_inside(t, p);
  }

  // The published triangle that holds p as no corner; a walk from t, which in an odd mesh might go in circles.
  Id triangle_with(const MeshPoint& p, Id t) const {
    for (int step = 0; step < kMostSteps; ++step) {
      const Triangle& c = mesh_.triangles[t];
      unsigned k = 0;
      while (k < 3 && twice_area(point(c[k]), point(c[after(k)]), p) >= 0) ++k;
      if (k == 3) {
        const bool taken =
            std::any_of(c.begin(), c.end(), [&](std::uint32_t v) { return mesh_.x[v] == p.x && mesh_.y[v] == p.y; });
        return taken || !published(c) ? kNone : t;
      }
      t = across_[t][k];
      if (t == kNone) return kNone;
    }
    return kNone;
  }

  bool split_inside(Id t, const MeshPoint& p) {
    const std::uint32_t stamp = stamp_[t];
    const Triangle corners = mesh_.triangles[t];
    for (const std::uint32_t v : corners) {
      if (has_room(v)) continue;
      relieve(t, v, corners);
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
    settle(v, {t, t1, t2});
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
      relieve(at, v, {c, d, d});
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
    settle(v, {t, t1, u, u1});
    return true;
  }

  // The quadrilateral around the edge of t from corner k: a, d, b, c counter-clockwise.
  struct Quad {
    Id t = kNone, u = kNone;
    std::uint32_t a = 0, b = 0, c = 0, d = 0;
    unsigned k = 0, j = 0;
  };
  // There is a triangle beyond that edge.
  Quad quad(Id t, unsigned k) const {
    Quad q;
    q.t = t, q.k = k, q.u = across_[t][k];
    const Triangle& c = mesh_.triangles[t];
    q.a = c[k], q.b = c[after(k)], q.c = c[before(k)];
    q.j = corner_of(q.u, q.b);
    q.d = mesh_.triangles[q.u][before(q.j)];
    return q;
  }
  // Convex, and with room for the other diagonal.
  bool fits(Id t, unsigned k, Quad& q, std::uint32_t reserve) const {
    if (across_[t][k] == kNone) return false;
    q = quad(t, k);
    return has_room(q.c, reserve) && has_room(q.d, reserve) && area(q.a, q.d, q.c) > 0 && area(q.d, q.b, q.c) > 0;
  }
  bool can_flip(Id t, unsigned k, Quad& q, std::uint32_t reserve) const {
    return fits(t, k, q, reserve) && !is_void(q.a) && !is_void(q.b) && !is_void(q.c) && !is_void(q.d);
  }
  bool makes_needle(const Quad& q) const {
    return !has_body(point(q.a), point(q.d), point(q.c)) || !has_body(point(q.d), point(q.b), point(q.c));
  }
  // With that edge turned neither triangle is published.
  bool is_on_rim(Id t, unsigned k, Quad& q) const {
    return fits(t, k, q, 0) && is_void(q.d) && !is_void(q.a) && !is_void(q.b) && !is_void(q.c);
  }
  // A needle along a rim, outside of which there is no data: with its rim edge turned it is not published, and the rim moves by
  // less than half a unit.
  bool can_shed(Id t, unsigned k, Quad& q) const { return is_on_rim(t, k, q) && all_but_on(point(q.a), point(q.b), point(q.c)); }
  // What the greater error of two triangles must stay below for their edge to be turned; none when there is no reason to. Over
  // the limit the error has to fall; below it the shape may improve. So refinement ends: the errors over the limit only ever
  // fall.
  std::optional<double> bound_for(const Quad& q) {
    const double now_m = std::max(error(q.t).error_m, error(q.u).error_m);
    if (now_m > limit_m_) return now_m;
    if (in_circle(point(q.a), point(q.b), point(q.c), point(q.d))) return std::nextafter(limit_m_, INFINITY);
    return std::nullopt;
  }
  // What turning an edge gives, measured once.
  struct Turned {
    Quad q;
    TriangleError first, second;
    double greater_m() const { return std::max(first.error_m, second.error_m); }
  };
  Turned turned(const Quad& q) const { return {q, measured({q.a, q.d, q.c}), measured({q.d, q.b, q.c})}; }

  // The same of its greater error, at a glance.
  bool stays_below(const Quad& q, double bound_m) const {
    const auto below = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
      return meter_.error_m({point(i), point(j), point(k)}, bound_m) < bound_m;
    };
    return below(q.a, q.d, q.c) && below(q.d, q.b, q.c);
  }

  void flip(const Turned& now) {
    const Quad& q = now.q;
    const Id bc = across_[q.t][after(q.k)], ca = across_[q.t][before(q.k)];
    const Id ad = across_[q.u][after(q.j)], db = across_[q.u][before(q.j)];
    set(q.t, {q.a, q.d, q.c}, {ad, q.u, ca});
    set(q.u, {q.d, q.b, q.c}, {db, bc, q.t});
    relink(ad, q.u, q.t);
    relink(bc, q.t, q.u);
    error_[q.t] = now.first, error_[q.u] = now.second;
    known_[q.t] = known_[q.u] = 1;
    --valence_[q.a], --valence_[q.b];
    ++valence_[q.c], ++valence_[q.d];
    ++result_.flipped;
  }

  // Turns edges opposite a new vertex while that pays, and queues what is over the limit.
  void settle(std::uint32_t v, std::vector<Id> around) {
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
  // Harm is repaired by insertions, but not for ever.
  bool may_harm(std::uint32_t v) { return ++harmed_[v] <= kMostHarms; }

  // The edge from corner k of t, if turning it does less harm than best and makes no needle.
  void prefer(Id t, unsigned k, std::optional<Turned>& best) const {
    Quad q;
    if (!can_flip(t, k, q, 0) || makes_needle(q)) return;
    const Turned now = turned(q);
    if (!best || now.greater_m() < best->greater_m()) best = now;
  }

  bool shed(Id t) {
    for (unsigned k = 0; k < 3; ++k) {
      Quad q;
      if (!can_shed(t, k, q)) continue;
      flip_and_queue(turned(q));
      return true;
    }
    return false;
  }

  // No corner more would help: a sliver, which rounding tilts. Turns the edge of it that does least harm.
  void turn(Id t) {
    std::optional<Turned> best;
    for (unsigned k = 0; k < 3; ++k) prefer(t, k, best);
    if (best && (best->greater_m() < error(t).error_m || may_harm(mesh_.triangles[t][0]))) flip_and_queue(*best);
  }

  // Takes a neighbour from v, a corner of t that is over the limit: turns the edge at v that does least harm. waiting: vertices
  // that must have room for one neighbour more afterwards.
  void relieve(Id t, std::uint32_t v, const Triangle& waiting) {
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
      if (!blocked) prefer(t, k, best);
      t = across_[t][before(k)];  // counter-clockwise around v
    } while (t != kNone && t != start);
    if (best && may_harm(v)) flip_and_queue(*best);
  }

  // The corner of u that its neighbour t does not have.
  std::uint32_t opposite(Id u, Id t) const {
    const unsigned j = across_[u][0] == t ? 0 : across_[u][1] == t ? 1 : 2;
    return mesh_.triangles[u][before(j)];
  }
  // On the border the fan around v starts somewhere.
  Id first_around(Id t, std::uint32_t v) const {
    const Id start = t;
    for (Id clockwise = across_[t][corner_of(t, v)]; clockwise != kNone && clockwise != start;
         clockwise = across_[t][corner_of(t, v)])
      t = clockwise;
    return t;
  }

  proto::TileMesh& mesh_;
  const ErrorMeter& meter_;
  double limit_m_;
  std::uint32_t crowd_;
  std::vector<std::array<Id, 3>> across_;
  std::vector<TriangleError> error_;
  std::vector<char> known_;
  std::vector<std::uint32_t> stamp_;     // indexed by triangle: changes when its corners do
  std::vector<std::uint32_t> valence_;   // indexed by vertex: neighbours
  std::map<std::uint32_t, int> harmed_;  // indexed by vertex: edges turned there to make room
  std::priority_queue<Entry> worst_;
  Refined result_;
};

}  // namespace cordillera::gpu
