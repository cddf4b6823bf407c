#pragma once
// A mesh while points go in: its triangles, their neighbours and errors, and what can be done to them one by one. It knows no
// order of work.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/mesh/refine_shape.h"
#include "gpu/mesh/tile_valence.h"
#include "gpu/mesh/triangle_neighbours.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

class MeasuredMesh {
 public:
  using Triangle = std::array<std::uint32_t, 3>;
  using Id = std::uint32_t;  ///< of a triangle

  /// crowd: neighbours more than its valence allows that a vertex may have for a while.
  MeasuredMesh(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::uint32_t crowd = 0)
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

 protected:
  static constexpr Id kNone = kNoTriangle;
  static constexpr int kMostSteps = 64;  ///< of a walk from triangle to triangle

  bool is_void(std::uint32_t v) const { return proto::is_void(mesh_, v); }
  bool published(const Triangle& t) const { return proto::is_published(mesh_, t); }
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
  bool can_shed_needle(Id t, unsigned k, Quad& q) const {
    return is_on_rim(t, k, q) && all_but_on(point(q.a), point(q.b), point(q.c));
  }
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
  std::vector<std::uint32_t> stamp_;    // indexed by triangle: changes when its corners do
  std::vector<std::uint32_t> valence_;  // indexed by vertex: neighbours
  Refined result_;
};

}  // namespace cordillera::gpu
