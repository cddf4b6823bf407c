#pragma once
// Half-edge collapses of a window: the cheapest one of a vertex, which go in a wave, and what their neighbours' rings become.
//
// Cost: the memoryless quadric along the vertical (P. Lindstrom, G. Turk, 1998 and 1999). It only orders the collapses; whether
// one may go is measured.
#include "gpu/exact/steps/window.h"
#include "gpu/mesh/vertical_quadric.h"

namespace cordillera::gpu::exact {

inline constexpr int kMostTried = 4;     ///< targets of one ring that may fail when measured, before the vertex is let be
inline constexpr int kMostLookedAt = 3;  ///< targets whose triangles are looked at in one evaluation
inline constexpr int kCostShift =
    19;  ///< a key is 13 bits of cost over 19 of a hash, so that neighbours of like cost do not queue
/// Of moving along a plane, a sample's square; without it a flat sea would have no order. Heights are 2^-10 m.
inline constexpr float kCostOfLength = 1e-6f * 1048576.0f;

CORDILLERA_HD inline std::int32_t cross(int ax, int ay, int bx, int by) { return ax * by - ay * bx; }

/// A thread that evaluates a vertex alone. Lanes that share one have the same members.
struct AloneLane {
  CORDILLERA_HD int index() const { return 0; }
  CORDILLERA_HD int count() const { return 1; }
  /// The least cost of all lanes, of equal ones that of the lowest slot; a slot below 0: none.
  CORDILLERA_HD void take_least(float&, int&) const {}
  /// What the lane with the highest k has; k below 0: none.
  CORDILLERA_HD void take_last(int, float&) const {}
  CORDILLERA_HD bool any(bool value) const { return value; }
};

/// u may go to that place of its ring, at that cost.
CORDILLERA_HD inline void make_ready(const WindowView& w, int u, int slot, float cost) {
  w.key(u) = float_bits(cost) >> kCostShift << kCostShift | (hash32(w.position(u) * 0x9e3779b1u) & ((1u << kCostShift) - 1));
  w.target(u) = static_cast<std::uint8_t>(slot);
  w.state(u) = kReady;
  w.rival(u) = u;
}

/// A vertex whose key is to be found, with its ring relative to it. Places of the ring are shared out among lanes.
template <class Lanes>
class Evaluation {
 public:
  CORDILLERA_HD Evaluation(const WindowView& w, int u, const Lanes& lanes)
      : w_(w),
        lanes_(lanes),
        u_(u),
        valence_(w.valence(u)),
        triangles_(w.triangles(u)),
        x_(w.x(u)),
        y_(w.y(u)),
        z_(w.height(u)),
        curve_(w.curve.at(w.y(u))) {
    sum_quadric();
  }

  /// Sets the vertex's key and target: its cheapest collapse that no law forbids and that has not been measured in vain with this
  /// ring.
  CORDILLERA_HD void run() {
    float last = -1;
    int last_slot = -1;
    for (int look = 0; look < kMostLookedAt; ++look) {
      float best = 1e38f;
      int slot = -1;
      for (int k = lanes_.index(); k < valence_; k += lanes_.count()) {
        if (!may_go_to(k)) continue;
        const Place at = place(k);
        const float x = static_cast<float>(at.x), y = static_cast<float>(at.y),
                    cost = quadric_.at(x, y, at.z) + kCostOfLength * (x * x + y * y);
        if ((cost > last || (cost == last && k > last_slot)) && cost < best) best = cost, slot = k;
      }
      lanes_.take_least(best, slot);
      if (slot < 0) return;
      last = best, last_slot = slot;
      if (!is_legal(slot)) continue;
      if (lanes_.index() != 0) return;
      make_ready(w_, u_, slot, best);
      return;
    }
  }

 private:
  struct Place {
    int x, y;
    float z;
  };
  CORDILLERA_HD Place place(int k) const {
    const int v = w_.entry(u_, k);
    return {w_.x(v) - x_, w_.y(v) - y_, w_.height(v) - z_};
  }
  /// The whole of it in every lane: floats are added in one order.
  CORDILLERA_HD void sum_quadric() {
    const bool u_void = (w_.flag(u_) & kVoidHere) != 0;
    bool a_void = is_void(0);
    Place a = place(0);
    voids_ = triangles_ < valence_ && a_void ? 1 : 0;
    for (int k = 0; k < triangles_; ++k) {
      const int after = w_.after(u_, k);
      const bool b_void = is_void(after);
      const Place b = place(after);
      if (!u_void && !a_void && !b_void) {
        quadric_.add(static_cast<float>(a.x), static_cast<float>(a.y), a.z, static_cast<float>(b.x), static_cast<float>(b.y),
                     b.z);
      }
      voids_ += b_void;
      rims_ += a_void != b_void;
      a = b, a_void = b_void;
    }
    all_valid_ = !u_void && voids_ == 0;
  }
  CORDILLERA_HD bool may_go_to(int slot) const {
    if (w_.tried(u_) >> slot & 1) return false;
    const std::uint8_t flag = w_.flag(u_);
    const int v = w_.entry(u_, slot);
    if ((flag & kOnUpright) && w_.x(v) != x_) return false;
    if ((flag & kOnLevel) && w_.y(v) != y_) return false;
    const int gain = valence_ - ((flag & kOpenFan) ? 3 : 4);
    return (gain <= 0 || w_.valence(v) + gain <= valence_cap(w_.flag(v))) && keeps_rim(slot);
  }
  /// Where rims may not move, a vertex of one goes along it: between two neighbours of which one is void. Others would be nearer,
  /// and measured in vain. It has two published triangles or more, side by side, so that all of their corners keep one.
  CORDILLERA_HD bool keeps_rim(int slot) const {
    if (w_.rules.rim_reach >= 0) return true;
    if (w_.flag(u_) & kVoidHere) return is_void(slot);
    if (voids_ == 0) return true;
    if ((w_.flag(u_) & kOpenFan) || rims_ != 2 || valence_ - voids_ < 3 || is_void(slot)) return false;
    return is_void(slot == 0 ? valence_ - 1 : slot - 1) != is_void(w_.after(u_, slot));
  }
  CORDILLERA_HD bool is_void(int slot) const { return (w_.flag(w_.entry(u_, slot)) & kVoidHere) != 0; }
  /// No triangle turns over, in plan or in space; and, since it is known at once: the sample under the vertex itself stays within
  /// the tolerance.
  CORDILLERA_HD bool is_legal(int slot) const {
    const Place p = place(slot);
    float surface = 0;
    int last = -1;
    bool turned = false;
    for (int k = lanes_.index(); k < triangles_ && !turned; k += lanes_.count()) {
      const int after = w_.after(u_, k);
      if (k == slot || after == slot) continue;
      const Place a = place(k), b = place(after);
      const std::int32_t area = cross(a.x - p.x, a.y - p.y, b.x - p.x, b.y - p.y);
      turned = area <= 0 || !(is_upright(area, a, b, p) || is_wider(area, a, b, p));
      const std::int32_t of_p = cross(a.x, a.y, b.x, b.y), of_a = cross(b.x, b.y, p.x, p.y), of_b = cross(p.x, p.y, a.x, a.y);
      if (of_a < 0 || of_p < 0 || of_b < 0) continue;
      const float share_p = static_cast<float>(of_p), share_a = static_cast<float>(of_a), share_b = static_cast<float>(of_b);
      surface = (share_p * p.z + share_a * a.z + share_b * b.z) / (share_p + share_a + share_b);
      last = k;
    }
    if (lanes_.any(turned)) return false;
    lanes_.take_last(last, surface);
    return !all_valid_ || magnitude(z_ + surface - w_.truth(u_)) <= w_.rules.tolerance;
  }

  /// Seen along a corner's normal the others are beside their places on the lattice, by up to twice of what Curve says of an
  /// edge, and rounded. A needle that is narrower than that, as wide as samples are there, may show its back.
  CORDILLERA_HD bool is_upright(std::int32_t area, const Place& a, const Place& b, const Place& c) const {
    const float wide = wide_of(a, b, c), high = high_of(a, b, c);
    return static_cast<float>(area) * curve_.narrow >
           (w_.rules.least_width + 4 * curve_.sway * wide * (wide + high)) * greater(wide, high);
  }

  /// Than the triangle at the vertex itself, in whose place it comes.
  CORDILLERA_HD bool is_wider(std::int32_t area, const Place& a, const Place& b, const Place& c) const {
    const Place u = {0, 0, 0};
    return static_cast<float>(area) * greater(wide_of(a, b, u), high_of(a, b, u)) >=
           static_cast<float>(cross(a.x, a.y, b.x, b.y)) * greater(wide_of(a, b, c), high_of(a, b, c));
  }
  CORDILLERA_HD float wide_of(const Place& a, const Place& b, const Place& c) const {
    return curve_.narrow * static_cast<float>(extent(a.x, b.x, c.x));
  }
  CORDILLERA_HD static float high_of(const Place& a, const Place& b, const Place& c) {
    return static_cast<float>(extent(a.y, b.y, c.y));
  }
  CORDILLERA_HD static float greater(float a, float b) { return a > b ? a : b; }
  CORDILLERA_HD static int extent(int a, int b, int c) { return greatest(a, greatest(b, c)) - least(a, least(b, c)); }

  const WindowView& w_;
  const Lanes& lanes_;
  const int u_, valence_, triangles_, x_, y_;
  const float z_;
  const CurveRow curve_;
  VerticalQuadric quadric_;
  int voids_ = 0;  ///< among its neighbours
  int rims_ = 0;   ///< between two neighbours of which one is void
  bool all_valid_ = true;
};

template <class Lanes>
CORDILLERA_HD inline void evaluate(const WindowView& w, int u, const Lanes& lanes) {
  if (lanes.index() == 0) {
    w.state(u) = kClean;
    w.key(u) = kNever;
  }
  const std::uint8_t flag = w.flag(u);
  if ((flag & kLocked) || (flag & (kOnUpright | kOnLevel)) == (kOnUpright | kOnLevel)) return;
  int tried = 0;
  for (std::uint32_t bits = w.tried(u); bits; bits &= bits - 1) ++tried;
  if (tried < kMostTried) Evaluation<Lanes>(w, u, lanes).run();
}

/// Does u go in this wave, if what it leaves fits? Its key is the least of its ring, and it is the first that goes to its target.
/// Its ring is that of the last wave, or it would be evaluated again: so it is asked first for whom it waited then.
CORDILLERA_HD inline bool wins(const WindowView& w, int u) {
  if (w.state(u) != kReady) return false;
  const std::uint32_t key = w.key(u);
  const int rival = w.rival(u);
  if (comes_before(w.key(rival), rival, key, u)) return false;
  for (int k = 0; k < w.valence(u); ++k) {
    const int v = w.entry(u, k);
    if (!comes_before(w.key(v), v, key, u)) continue;
    w.rival(u) = v;
    return false;
  }
  const int target = w.entry(u, w.target(u));
  const int gain = w.valence(u) - ((w.flag(u) & kOpenFan) ? 3 : 4);
  if (gain > 0 && w.valence(target) + gain > valence_cap(w.flag(target))) {
    w.state(u) = kStale;
    return false;
  }
  for (int k = 0; k < w.valence(target); ++k) {
    const int v = w.entry(target, k);
    if ((v & kOutside) || w.key(v) == kNever) continue;
    if (comes_before(w.key(v), v, key, u) && w.entry(v, w.target(v)) == target) return false;
  }
  return true;
}

/// Triangle k of the valence - 2 that are there when u has gone to its target; on a side as inside.
struct AfterCollapse {
  const WindowView& w;
  CORDILLERA_HD int vertex(int i) const { return w.winner(i); }
  CORDILLERA_HD int count(int i) const { return w.valence(vertex(i)) - 2; }
  CORDILLERA_HD Triangle triangle(int i, int k) const {
    const int u = vertex(i), n = w.valence(u), target = w.target(u);
    int a = target + 1 + k, b = target + 2 + k;
    a = a >= n ? a - n : a;
    b = b >= n ? b - n : b;
    return make_triangle(w.corner(w.entry(u, target)), w.corner(w.entry(u, a)), w.corner(w.entry(u, b)), w.demand());
  }
  CORDILLERA_HD bool has_failed(int i) const { return *static_cast<volatile std::uint8_t*>(&w.state(vertex(i))) == kStale; }
  CORDILLERA_HD void fail(int i) const { w.state(vertex(i)) = kStale; }
};

CORDILLERA_HD inline void commit_collapse(const WindowView& w, int u) {
  if (w.state(u) == kStale) {
    w.tried(u) = static_cast<std::uint16_t>(w.tried(u) | 1u << w.target(u));
    return;
  }
  w.state(u) = kDead;
  w.key(u) = kNever;
  for (int k = 0; k < w.valence(u); ++k) w.state(w.entry(u, k)) = kTouched;
}

/// The ring of v without the vertices that went. No two of them are neighbours, so each leaves the others' rings as they were.
CORDILLERA_HD inline void gather(const WindowView& w, int v) {
  std::uint16_t ring[kRingWidth + 2];
  int count = 0;
  const int valence = w.valence(v);
  for (int i = 0; i < valence; ++i) {
    const int u = w.entry(v, i);
    if ((u & kOutside) || w.state(u) != kDead) {
      ring[count++] = static_cast<std::uint16_t>(u);
      continue;
    }
    const int n = w.valence(u), target = w.target(u);
    int slot = 0;
    while (w.entry(u, slot) != v) ++slot;
    const bool open = (w.flag(u) & kOpenFan) != 0;
    if (slot == target) {  // v gets what u had, but the two that they shared
      int from = open ? (slot == 0 ? 2 : 0) : slot + 2, left = open ? n - 2 : n - 3;
      for (; left > 0; --left, ++from) {
        if (from >= n) from -= n;
        ring[count++] = w.entry(u, from);
      }
    } else {
      const int apart = slot > target ? slot - target : target - slot;
      if (apart == 1 || (!open && apart == n - 1)) continue;  // shared with the target
      ring[count++] = w.entry(u, target);
    }
  }
  for (int i = 0; i < count; ++i) w.entry(v, i) = ring[i];
  w.valence(v) = static_cast<std::uint8_t>(count);
  w.tried(v) = 0;
}

}  // namespace cordillera::gpu::exact
