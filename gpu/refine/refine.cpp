#include "gpu/refine/refine.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <vector>

#include "gpu/mesh/refine_shape.h"
#include "gpu/mesh/rings.h"
#include "gpu/mesh/triangle_neighbours.h"

namespace cordillera::gpu {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Id = std::uint32_t;
constexpr Id kNone = kNoTriangle;
constexpr std::uint32_t kReserve = 2;  // places at a vertex that edges turned for shape leave to insertions
constexpr int kMostSteps = 64;         // of a walk from triangle to triangle
constexpr int kMostHarms = 32;         // at a vertex: edges turned to make room, or away from needles, might turn back for ever
constexpr std::uint32_t kCrowd = 4;    // neighbours more than its valence allows that a vertex has for a while in a crowded place
constexpr std::size_t kMostCrowded = 16;  // points that go in there at a time
constexpr std::size_t kMostTurns = 256;  // of edges that cross one that is to be there

class Refinement {
 public:
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

  /// Makes these points vertices and the lines between them edges, which neighbours on the lattice can always be, and refines what that has left
  /// over the limit. False: some is left, or a vertex has too many neighbours.
  bool make_triangle(Id t, const std::array<MeshPoint, 3>& corners) {
    if (std::any_of(corners.begin(), corners.end(), [](const MeshPoint& p) { return p.height == proto::kNoHeight; })) return take_off_rim(t);
    std::array<std::uint32_t, 3> v{};
    for (unsigned k = 0; k < 3; ++k) {
      const std::optional<std::uint32_t> made = make_vertex(t, corners[k]);
      if (!made) return false;
      v[k] = *made;
    }
    return make_edge(v[0], v[1]) && make_edge(v[1], v[2]) && make_edge(v[2], v[0]) && finish();
  }
  /// Likewise a corner inside the tile and the ends of the edge of the tile's side that passes another one, where no vertex is.
  bool make_triangle_on_side(Id t, const MeshPoint& inside, const MeshPoint& on_side) {
    if (inside.height == proto::kNoHeight || is_on_side(inside) || !is_on_side(on_side) || vertex_at(on_side)) return false;
    const auto edge = edge_of_side(on_side);
    if (!edge) return false;
    const std::optional<std::uint32_t> v = make_vertex(t, inside);
    return v && make_edge(*v, edge->first) && make_edge(*v, edge->second) && finish();
  }
  /// The triangle that make_triangle took off the rim.
  std::optional<Id> taken_off() const { return taken_off_; }

 private:
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
        const bool taken = std::any_of(c.begin(), c.end(), [&](std::uint32_t v) { return mesh_.x[v] == p.x && mesh_.y[v] == p.y; });
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
  bool is_on_rim(Id t, unsigned k, Quad& q) const { return fits(t, k, q, 0) && is_void(q.d) && !is_void(q.a) && !is_void(q.b) && !is_void(q.c); }
  // A needle along a rim, outside of which there is no data: with its rim edge turned it is not published, and the rim moves by less than
  // half a unit.
  bool can_shed(Id t, unsigned k, Quad& q) const {
    return is_on_rim(t, k, q) && all_but_on(point(q.a), point(q.b), point(q.c));
  }
  // What the greater error of two triangles must stay below for their edge to be turned; none when there is no reason to. Over the limit
  // the error has to fall; below it the shape may improve. So refinement ends: the errors over the limit only ever fall.
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
    const auto below = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) { return meter_.error_m({point(i), point(j), point(k)}, bound_m) < bound_m; };
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

  // Of twice the area of 1: no sample lies in it or on its sides, so none is uncovered.
  bool take_off_rim(Id t) {
    const Triangle& c = mesh_.triangles[t];
    if (area(c[0], c[1], c[2]) != 1) return false;
    for (unsigned k = 0; k < 3; ++k) {
      Quad q;
      if (!is_on_rim(t, k, q)) continue;
      flip(turned(q));
      return true;
    }
    // The mesh may end at the rim. Of a triangle with two sides there a corner would lose its last one.
    if (std::count(across_[t].begin(), across_[t].end(), kNone) != 1) return false;
    const auto k = static_cast<unsigned>(std::find(across_[t].begin(), across_[t].end(), kNone) - across_[t].begin());
    if (lie_on_a_side(point(c[k]), point(c[after(k)]))) return false;
    taken_off_ = t;
    return true;
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

  // Takes a neighbour from v, a corner of t that is over the limit: turns the edge at v that does least harm. waiting: vertices that must
  // have room for one neighbour more afterwards.
  void relieve(Id t, std::uint32_t v, const Triangle& waiting) {
    const auto in_the_way = [&](std::uint32_t w) { return std::find(waiting.begin(), waiting.end(), w) != waiting.end() && !has_room(w, 1); };
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

  // What making a triangle has left over the limit, and neighbours that are too many.
  bool finish() {
    std::vector<Id> changed;
    for (Id u = 0; u < mesh_.triangles.size(); ++u) {
      if (stamp_[u] > 0) changed.push_back(u);
    }
    run(changed, kMostCrowded);
    return !is_over(worst_known()) && disperse();
  }

  bool is_on_side(const MeshPoint& p) const { return p.x == 0 || p.y == 0 || p.x == mesh_.side || p.y == mesh_.side; }
  std::optional<std::uint32_t> vertex_at(const MeshPoint& p) const {
    for (std::uint32_t v = 0; v < mesh_.vertices(); ++v) {
      if (mesh_.x[v] == p.x && mesh_.y[v] == p.y) return v;
    }
    return std::nullopt;
  }
  // The vertex at p, which becomes one if there is none. t: a triangle near it.
  std::optional<std::uint32_t> make_vertex(Id t, const MeshPoint& p) {
    for (int k = 0; k < 4; ++k) {  // to make room, the triangle itself may be turned first
      if (const auto v = vertex_at(p)) return is_void(*v) ? std::nullopt : v;
      const Id at = triangle_with(p, t);
      if (at == kNone || !split(at, p)) return std::nullopt;
    }
    return std::nullopt;
  }
  bool lie_on_a_side(const MeshPoint& a, const MeshPoint& b) const {
    return (a.x == b.x && (a.x == 0 || a.x == mesh_.side)) || (a.y == b.y && (a.y == 0 || a.y == mesh_.side));
  }
  // The ends of the edge on a side of the tile that passes p, which is no corner of it.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> edge_of_side(const MeshPoint& p) const {
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      for (unsigned k = 0; k < 3; ++k) {
        const std::uint32_t v = mesh_.triangles[t][k], w = mesh_.triangles[t][after(k)];
        const MeshPoint a = point(v), b = point(w);
        if (across_[t][k] != kNone || !lie_on_a_side(a, b) || !lie_on_a_side(a, p) || !lie_on_a_side(b, p)) continue;
        if ((a.x - p.x) * (b.x - p.x) + (a.y - p.y) * (b.y - p.y) < 0) return std::pair{v, w};
      }
    }
    return std::nullopt;
  }

  bool crosses(std::uint32_t u, std::uint32_t w, std::uint32_t a, std::uint32_t b) const {
    const auto side = [](std::int64_t area) { return area > 0 ? 1 : area < 0 ? -1 : 0; };
    return side(area(a, b, u)) * side(area(a, b, w)) < 0 && side(area(u, w, a)) * side(area(u, w, b)) < 0;
  }
  // The edge a - b, by turning those that cross it (S. W. Sloan, "A fast algorithm for generating constrained Delaunay triangulations", 1993).
  bool make_edge(std::uint32_t a, std::uint32_t b) {
    for (std::size_t turns = 0; turns < kMostTurns; ++turns) {
      std::vector<Quad> crossing, clearing;  // convex ones; those whose other diagonal is out of the way
      bool crossed = false;
      for (Id t = 0; t < mesh_.triangles.size(); ++t) {
        for (unsigned k = 0; k < 3; ++k) {
          Quad q;
          if (!crosses(mesh_.triangles[t][k], mesh_.triangles[t][after(k)], a, b)) continue;
          crossed = true;
          if (!can_flip(t, k, q, 0)) continue;
          crossing.push_back(q);
          if (!crosses(q.c, q.d, a, b)) clearing.push_back(q);
        }
      }
      if (!crossed) return true;
      if (crossing.empty()) return false;
      flip(turned(clearing.empty() ? crossing[turns % crossing.size()] : clearing.front()));  // another one each time, not one back and forth
    }
    return false;
  }

  // Of the triangles that were measured.
  Id worst_known() const {
    Id worst = 0;
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      if (known_[t] && (!known_[worst] || error_[t].error_m > error_[worst].error_m)) worst = t;
    }
    return worst;
  }

  // Turns edges until no vertex has more neighbours than it may have without a crowd. False: that could not be done.
  bool disperse() {
    crowd_ = 0;
    for (std::uint32_t v = 0; v < valence_.size(); ++v) {
      while (valence_[v] > cap(v)) {
        if (!take_neighbour(v)) return false;
      }
    }
    return true;
  }
  // Takes a neighbour from v where both triangles stay within the limit.
  bool take_neighbour(std::uint32_t v) {
    std::optional<Turned> best;
    for (Id t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& c = mesh_.triangles[t];
      if (c[0] == v || c[1] == v || c[2] == v) prefer(t, corner_of(t, v), best);
    }
    if (!best || best->greater_m() > limit_m_) return false;
    flip(*best);
    return true;
  }
  // The corner of u that its neighbour t does not have.
  std::uint32_t opposite(Id u, Id t) const {
    const unsigned j = across_[u][0] == t ? 0 : across_[u][1] == t ? 1 : 2;
    return mesh_.triangles[u][before(j)];
  }
  // On the border the fan around v starts somewhere.
  Id first_around(Id t, std::uint32_t v) const {
    const Id start = t;
    for (Id clockwise = across_[t][corner_of(t, v)]; clockwise != kNone && clockwise != start; clockwise = across_[t][corner_of(t, v)]) t = clockwise;
    return t;
  }

  proto::TileMesh& mesh_;
  const ErrorMeter& meter_;
  double limit_m_;
  std::uint32_t crowd_;
  std::vector<std::array<Id, 3>> across_;
  std::vector<TriangleError> error_;
  std::vector<char> known_;
  std::vector<std::uint32_t> stamp_;    // indexed by triangle: changes when its corners do
  std::vector<std::uint32_t> valence_;  // indexed by vertex: neighbours
  std::map<std::uint32_t, int> harmed_;  // indexed by vertex: edges turned there to make room
  std::priority_queue<Entry> worst_;
  std::optional<Id> taken_off_;
  Refined result_;
};

}  // namespace

Refined refine(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over,
               std::size_t most) {
  return over.empty() ? Refined{} : Refinement(mesh, meter, limit_m).run(over, most);
}

Refined refine_stuck(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over) {
  Refined all;
  std::vector<Id> left(over.rbegin(), over.rend());
  while (!left.empty()) {
    const Id t = left.back();
    left.pop_back();
    const Triangle& c = mesh.triangles[t];
    const auto point = [&](std::uint32_t v) { return MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
    const auto wanted = meter.wanted({point(c[0]), point(c[1]), point(c[2])}, limit_m);
    if (!wanted) continue;
    std::optional<proto::TileMesh> made;
    std::optional<Id> off;
    // As it is wanted; else with two corners on a side of the tile, whose vertices are not to be changed.
    for (unsigned way = 0; way < 7 && !made; ++way) {
      proto::TileMesh trial = mesh;
      Refinement refinement(trial, meter, limit_m, kCrowd);
      const unsigned inside = (way + 2) % 3, on_side = (inside + 1 + (way - 1) / 3) % 3;
      if (!(way == 0 ? refinement.make_triangle(t, *wanted) : refinement.make_triangle_on_side(t, (*wanted)[inside], (*wanted)[on_side]))) continue;
      made = std::move(trial);
      off = refinement.taken_off();
    }
    if (!made) {
      ++all.over;
      continue;
    }
    all.inserted += static_cast<std::uint32_t>(made->vertices() - mesh.vertices());
    mesh = std::move(*made);
    if (!off) continue;
    const Id last = static_cast<Id>(mesh.triangles.size() - 1);
    mesh.triangles[*off] = mesh.triangles[last];
    mesh.triangles.pop_back();
    std::replace(left.begin(), left.end(), last, *off);
  }
  return all;
}

}  // namespace cordillera::gpu
