#pragma once
// Heights of vertices: each moves to the least squares of the samples around it, as far as all of them stay within the tolerance.
// Sums are whole numbers, so no order shows in them.
#include "gpu/exact/steps/window.h"

namespace cordillera::gpu::exact {

/// Of how many samples in a triangle's box a height is found, about; more change it little.
inline constexpr int kSamplesAsked = 64;
inline constexpr float kPullUnits = 1024;  ///< a tolerance, in the units of sums
inline constexpr int kPullWeight = 256;    ///< of a sample at the vertex itself

/// Normal equation of one vertex: its height should change by sum / weight.
struct Pull {
  std::int32_t sum = 0, weight = 0;
};

/// Every 2^shift-th sample of a box, both ways.
CORDILLERA_HD inline int pull_shift(const Triangle& t) {
  const int box = (t.east - t.west + 1) * (t.north - t.south + 1);
  int shift = 0;
  while (box > kSamplesAsked << 2 * shift) ++shift;
  return shift;
}

/// The samples of one triangle around a vertex, its first corner.
struct PullBox {
  Triangle t;
  int stride, west, south, columns, rows, count;
  float per_area, per_tolerance;

  /// units: kPullUnits of a tolerance.
  CORDILLERA_HD PullBox(const Triangle& triangle, float units) : t(triangle), per_tolerance(units) {
    const int shift = pull_shift(t);
    stride = 1 << shift;
    west = (t.west + stride - 1) >> shift;
    south = (t.south + stride - 1) >> shift;
    columns = (t.east >> shift) - west + 1;
    rows = t.published ? (t.north >> shift) - south + 1 : 0;
    count = columns * rows;
    per_area = static_cast<float>(kPullWeight) / static_cast<float>(t.twice_area());
  }
  CORDILLERA_HD void add(const Field& field, int column, int row, Pull& pull) const {
    const int x = (west + column) * stride, y = (south + row) * stride;
    const float sample = field.height_at(x, y);  // read in any case, so that several are on their way at once
    if (!t.covers(x, y) || field.is_void_there(x, y)) return;
    const float off = -t.height_above(static_cast<float>(x), static_cast<float>(y), sample);
    const auto near =
        static_cast<std::int32_t>(static_cast<float>(t.edge(1, x, y)) * per_area + 0.5f);  // edge 1 faces the first corner
    const auto units = static_cast<std::int32_t>(nearest_whole(off * per_tolerance));
    pull.sum += near * units / 16;
    pull.weight += near * near / 16;
  }
  /// All of them, one after the other.
  CORDILLERA_HD Pull all(const Field& field) const {
    Pull pull;
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) add(field, column, row, pull);
    }
    return pull;
  }
};

/// What is known of a height that is tried; where the target of a collapse lies otherwise.
enum HeightTrial : std::uint8_t { kUnmeasured = 0, kMisfit, kFitting };

CORDILLERA_HD inline bool may_move(const WindowView& w, int u) {
  return !(w.flag(u) & (kLocked | kOpenFan | kVoidHere)) && w.state(u) != kDead;
}

/// In an order by hash, so that no two neighbours move at once.
CORDILLERA_HD inline void queue_height(const WindowView& w, int u, int round) {
  if (w.state(u) == kDead) return;
  if (w.key(u) != kNever) w.state(u) = kStale;  // a collapse not done yet is found again
  w.key(u) = may_move(w, u) ? hash32(w.position(u) + 77u * static_cast<std::uint32_t>(round)) >> 1 : kNever;
}
/// Counts the neighbours that move before u. True: there is none.
CORDILLERA_HD inline bool moves_first(const WindowView& w, int u) {
  const std::uint32_t key = w.key(u);
  if (key == kNever || w.state(u) == kDead) return false;
  int waits = 0;
  for (int k = 0; k < w.valence(u); ++k) {
    const int v = w.entry(u, k);
    if (comes_before(w.key(v), v, key, u)) --waits;
  }
  w.waits(u) = waits;
  return waits == 0;
}

/// The triangles around a vertex that is to move, with the height it would have (measured) or has (pulled).
struct AroundVertex {
  const WindowView& w;
  const float units;  ///< see PullBox

  CORDILLERA_HD explicit AroundVertex(const WindowView& window) : w(window), units(kPullUnits / window.rules.tolerance) {}
  CORDILLERA_HD int vertex(int i) const { return w.winner(i); }
  CORDILLERA_HD int count(int i) const { return w.valence(vertex(i)); }
  CORDILLERA_HD Triangle triangle_at(int i, int k, float height) const {
    const int u = vertex(i);
    Corner at = w.corner(u);
    at.height = height;
    return make_triangle(at, w.corner(w.entry(u, k)), w.corner(w.entry(u, w.after(u, k))), w.demand());
  }
  CORDILLERA_HD Triangle triangle(int i, int k) const { return triangle_at(i, k, w.next_height(vertex(i))); }
  CORDILLERA_HD PullBox box(int i, int k) const { return {triangle_at(i, k, w.height(vertex(i))), units}; }
  CORDILLERA_HD bool has_failed(int i) const {
    const int u = vertex(i);
    return *static_cast<volatile std::uint8_t*>(&w.target(u)) != 0 || w.next_height(u) == w.height(u);
  }
  CORDILLERA_HD void fail(int i) const { w.target(vertex(i)) = kMisfit; }
};

CORDILLERA_HD inline void begin_move(const WindowView& w, int u) {
  w.pull(u) = w.pull_weight(u) = 0;
  w.key(u) = kNever;
  w.target(u) = kUnmeasured;
}
CORDILLERA_HD inline void choose_height(const WindowView& w, int u) {
  const std::int32_t sum = w.pull(u), weight = w.pull_weight(u);
  float move = 0;
  if (weight != 0) {
    const double by = static_cast<double>(sum) / weight * (kPullWeight / static_cast<double>(kPullUnits)) *
                      static_cast<double>(w.rules.tolerance);
    move = static_cast<float>(nearest_whole(by / static_cast<double>(w.rules.height_step))) * w.rules.height_step;
  }
  w.next_height(u) = w.height(u) + move;
}
/// Where the height did not fit: half-way, and then not at all. What fits is not measured again.
CORDILLERA_HD inline void yield_height(const WindowView& w, int u, int attempt) {
  if (w.target(u) != kMisfit) {
    w.target(u) = kFitting;
    return;
  }
  w.target(u) = kUnmeasured;
  const float move = w.next_height(u) - w.height(u);
  w.next_height(u) = attempt == 0 ? w.height(u) + rounded_to(0.5f * move, w.rules.height_step) : w.height(u);
}
CORDILLERA_HD inline void commit_height(const WindowView& w, int u) {
  if (w.next_height(u) == w.height(u)) return;
  w.height(u) = w.next_height(u);
  w.state(u) = kTouched;
  for (int k = 0; k < w.valence(u); ++k) w.state(w.entry(u, k)) = kTouched;
}
CORDILLERA_HD inline void ask_again(const WindowView& w, int u) {
  if (w.state(u) != kTouched) return;
  w.state(u) = kStale;
  w.tried(u) = 0;
}

}  // namespace cordillera::gpu::exact
