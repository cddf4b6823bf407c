#include "gpu/exact/steps/whole_ring.h"

#include "gpu/exact/steps/lanes.h"

namespace cordillera::gpu::exact {
namespace {

constexpr int kPlacesOfRing = 2 * kLanes;  // no fewer than kRingWidth

/// Neighbours of a vertex, relative to it, in its ring's order; the first one again after the last.
struct RelativeRing {
  std::int32_t x[kPlacesOfRing + 1], y[kPlacesOfRing + 1];
  float z[kPlacesOfRing + 1];
  std::int32_t is_void[kPlacesOfRing + 1];  // -1 or 0
  unsigned may_go_to = 0;                   // bit by place
  bool has_void = false;
};

/// Evaluation::keeps_rim, bit by place.
unsigned along_rim(unsigned voids, int valence, std::uint8_t flag) {
  const unsigned all = (1u << valence) - 1;
  if (flag & kVoidHere) return voids;
  if (voids == 0) return all;
  const unsigned before = (voids << 1 | voids >> (valence - 1)) & all, after = voids >> 1 | (voids << (valence - 1) & all);
  if ((flag & kOpenFan) || __builtin_popcount(voids ^ after) != 2 || valence - __builtin_popcount(voids) < 3) return 0;
  return (before ^ after) & ~voids;
}

CORDILLERA_LANES void read_ring(const WindowView& w, int u, int valence, RelativeRing& ring) {
  const Ints none = {};
  for (int k = 0; k < kPlacesOfRing; k += kLanes) {
    store(ring.x + k, none);
    store(ring.y + k, none);
    store(ring.z + k, none);
    store(ring.is_void + k, none);
  }
  const int x = w.x(u), y = w.y(u);
  const float z = w.height(u);
  const std::uint8_t flag = w.flag(u);
  const int gain = valence - ((flag & kOpenFan) ? 3 : 4);
  const bool keeps_x = (flag & kOnUpright) != 0, keeps_y = (flag & kOnLevel) != 0;
  unsigned may = 0, voids = 0;  // bit by place
  for (int k = 0; k < valence; ++k) {
    const int v = w.entry(u, k);
    const std::uint32_t position = w.position(v);
    const std::uint8_t other = w.flag(v);
    ring.x[k] = position_x(position) - x;
    ring.y[k] = position_y(position) - y;
    ring.z[k] = w.height(v) - z;
    ring.is_void[k] = (other & kVoidHere) ? -1 : 0;
    voids |= static_cast<unsigned>((other & kVoidHere) != 0) << k;
    const bool may_go = !(keeps_x & (ring.x[k] != 0)) & !(keeps_y & (ring.y[k] != 0)) &
                        ((gain <= 0) | (w.valence(v) + gain <= valence_cap(other)));
    may |= static_cast<unsigned>(may_go) << k;
  }
  ring.x[valence] = ring.x[0], ring.y[valence] = ring.y[0], ring.z[valence] = ring.z[0], ring.is_void[valence] = ring.is_void[0];
  if (w.rules.rim_reach < 0) may &= along_rim(voids, valence, flag);
  ring.may_go_to = may & ~static_cast<unsigned>(w.tried(u));
  ring.has_void = voids != 0;
}

/// Corners a and b of the triangles of a vertex, from place `first` on.
struct Corners {
  Ints ax, ay, bx, by, there;
  Floats az, bz;
};
CORDILLERA_LANES void read_corners(const RelativeRing& ring, int first, int triangles, Corners& c) {
  const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
  load(c.ax, ring.x + first);
  load(c.ay, ring.y + first);
  load(c.az, ring.z + first);
  load(c.bx, ring.x + first + 1);
  load(c.by, ring.y + first + 1);
  load(c.bz, ring.z + first + 1);
  c.there = lane + first < triangles;
}

/// Added up in the ring's order; what is not there counts nothing.
CORDILLERA_LANES void sum_quadric(const RelativeRing& ring, int triangles, bool u_void, VerticalQuadric& q) {
  if (u_void) return;
  for (int first = 0; first < triangles; first += kLanes) {
    Corners c;
    read_corners(ring, first, triangles, c);
    Ints a_void, b_void;
    load(a_void, ring.is_void + first);
    load(b_void, ring.is_void + first + 1);
    const Ints counts = c.there & ~(a_void | b_void);
    const Floats ax = __builtin_convertvector(c.ax, Floats), ay = __builtin_convertvector(c.ay, Floats),
                 bx = __builtin_convertvector(c.bx, Floats), by = __builtin_convertvector(c.by, Floats);
    const Floats area = ax * by - ay * bx, nx = ay * c.bz - c.az * by, ny = c.az * bx - ax * c.bz, inverse = 1.0f / area;
    Floats term[6] = {nx * nx * inverse, nx * ny * inverse, ny * ny * inverse, nx, ny, area};
    float terms[6][kLanes];
    for (int k = 0; k < 6; ++k) {
      keep(term[k], counts);
      store(terms[k], term[k]);
    }
    const int last = least(kLanes, triangles - first);
    for (int k = 0; k < last; ++k) {
      q.xx += terms[0][k];
      q.xy += terms[1][k];
      q.yy += terms[2][k];
      q.x += terms[3][k];
      q.y += terms[4][k];
      q.one += terms[5][k];
    }
  }
}

/// Of going to each place of the ring.
CORDILLERA_LANES void find_costs(const RelativeRing& ring, int valence, const VerticalQuadric& q, float (&cost)[kPlacesOfRing]) {
  for (int first = 0; first < kPlacesOfRing && first < valence; first += kLanes) {
    Ints x, y;
    Floats pz;
    load(x, ring.x + first);
    load(y, ring.y + first);
    load(pz, ring.z + first);
    const Floats px = __builtin_convertvector(x, Floats), py = __builtin_convertvector(y, Floats);
    Floats all = 0.5f * (q.xx * px * px + q.yy * py * py + q.one * pz * pz) + (q.xy * px * py + pz * (q.x * px + q.y * py));
    keep(all, ~(all < 0.0f));
    store(cost + first, all + kCostOfLength * (px * px + py * py));
  }
}

CORDILLERA_LANES void greatest_of(const Floats& a, const Floats& b, Floats& to) { to = a > b ? a : b; }
CORDILLERA_LANES void extent_of(const Ints& a, const Ints& b, const Ints& c, Floats& to) {
  const Ints low = a < b ? a : b, high = a > b ? a : b;
  to = __builtin_convertvector((high > c ? high : c) - (low < c ? low : c), Floats);
}

/// Evaluation::is_legal.
CORDILLERA_LANES bool is_legal(const RelativeRing& ring, int slot, int valence, int triangles, float least_width,
                               const CurveRow& curve, float& surface) {
  const Ints px = ring.x[slot] + Ints{}, py = ring.y[slot] + Ints{}, none = {};
  const int before = slot == 0 ? valence - 1 : slot - 1;  // the triangle that ends at slot
  surface = 0;
  for (int first = 0; first < triangles; first += kLanes) {
    const Ints lane = Ints{0, 1, 2, 3, 4, 5, 6, 7} + first;
    Corners c;
    read_corners(ring, first, triangles, c);
    const Ints there = c.there & (lane != slot) & (lane != before);
    const Ints area = (c.ax - px) * (c.by - py) - (c.ay - py) * (c.bx - px);
    const Ints of_p = c.ax * c.by - c.ay * c.bx, of_a = c.bx * py - c.by * px, of_b = px * c.ay - py * c.ax;
    Floats wide, high, wide_before, high_before, long_now, long_before;
    extent_of(c.ax, c.bx, px, wide);
    extent_of(c.ay, c.by, py, high);
    extent_of(c.ax, c.bx, none, wide_before);
    extent_of(c.ay, c.by, none, high_before);
    wide = curve.narrow * wide;
    greatest_of(wide, high, long_now);
    greatest_of(curve.narrow * wide_before, high_before, long_before);
    const Floats as_float = __builtin_convertvector(area, Floats);
    const Ints upright = as_float * curve.narrow > (least_width + 4 * curve.sway * wide * (wide + high)) * long_now;
    const Ints wider = as_float * long_before >= __builtin_convertvector(of_p, Floats) * long_now;
    if (any(there & ((area <= 0) | ~(upright | wider)))) return false;
    const unsigned over = lanes_of(there & ((of_p | of_a | of_b) >= 0));
    if (over == 0) continue;
    const int last = 31 - __builtin_clz(over), k = first + last;
    const auto share_p = static_cast<float>(of_p[last]), share_a = static_cast<float>(of_a[last]),
               share_b = static_cast<float>(of_b[last]);
    surface = (share_p * ring.z[slot] + share_a * ring.z[k] + share_b * ring.z[k + 1]) / (share_p + share_a + share_b);
  }
  return true;
}

}  // namespace

CORDILLERA_WIDE void evaluate_whole_ring(const WindowView& w, int u) {
  w.state(u) = kClean;
  w.key(u) = kNever;
  const std::uint8_t flag = w.flag(u);
  if ((flag & kLocked) || (flag & (kOnUpright | kOnLevel)) == (kOnUpright | kOnLevel)) return;
  if (__builtin_popcount(w.tried(u)) >= kMostTried) return;
  const int valence = w.valence(u), triangles = w.triangles(u);
  RelativeRing ring;
  read_ring(w, u, valence, ring);
  if (ring.may_go_to == 0) return;
  const bool u_void = (flag & kVoidHere) != 0;
  VerticalQuadric quadric;
  sum_quadric(ring, triangles, u_void, quadric);
  float cost[kPlacesOfRing];
  find_costs(ring, valence, quadric, cost);
  const CurveRow curve = w.curve.at(w.y(u));
  for (int look = 0; look < kMostLookedAt; ++look) {
    float best = 1e38f;
    int slot = -1;
    for (unsigned left = ring.may_go_to; left != 0; left &= left - 1) {
      const int k = __builtin_ctz(left);
      if (cost[k] < best) best = cost[k], slot = k;
    }
    if (slot < 0) return;
    ring.may_go_to &= ~(1u << slot);
    float surface = 0;
    if (!is_legal(ring, slot, valence, triangles, w.rules.least_width, curve, surface)) continue;
    const bool all_valid = !u_void && !ring.has_void;
    if (all_valid && magnitude(w.height(u) + surface - w.truth(u)) > w.rules.tolerance) continue;
    make_ready(w, u, slot, best);
    return;
  }
}

}  // namespace cordillera::gpu::exact
