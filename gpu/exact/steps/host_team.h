#pragma once
// The team of a host: one thread, plain loops; samples eight at a time. See window_pass.h.
#include <cstring>

#include "gpu/exact/steps/coded.h"
#include "gpu/exact/steps/collapse.h"
#include "gpu/exact/steps/eight_columns.h"
#include "gpu/exact/steps/heights.h"
#include "gpu/exact/steps/squares.h"
#include "gpu/exact/steps/whole_ring.h"

namespace cordillera::gpu::exact {

inline constexpr int kRowsSoonSeen = 48;  ///< of eight samples

/// Voids are few: squares of 8 (of a tier) that have none are looked at as if there were none at all.
inline bool has_void(const Field& field, const SquareRange& range, int tier = 0) {
  if (!field.has_voids()) return false;
  for (int y = range.south; y <= range.north; ++y) {
    for (int x = range.west; x <= range.east; ++x) {
      if (has_deep_void(field.tier_depth[tier][y * field.tier_stride[tier] + x], -1)) return true;
    }
  }
  return false;
}

/// So few samples that asking what is known of their squares would take longer than looking at them.
inline bool is_soon_seen(const Triangle& t) { return ((t.east - t.west) / 8 + 1) * (t.north - t.south + 1) <= kRowsSoonSeen; }

struct EightAtOnce {
  bool operator()(const Triangle& t, const Field& field, int sx, int sy) const {
    const bool plain = t.published && !has_void(field, {sx, sx, sy, sy});
    if (!field.height) return plain ? eight_coded_fit(t, field, sx, sy) : coded_samples_fit(t, field, sx, sy);
    if (!plain) return samples_fit(t, field, sx, sy);
    return eight_columns_fit(t, field, 8 * sx, greatest(8 * sy, t.south), least(8 * sy + 7, t.north));
  }
};

/// All samples under a triangle.
inline bool fits(const Triangle& t, const Field& field) {
  if (!can_fit(t)) return false;
  if (field.height && t.published && is_soon_seen(t) && !has_void(field, squares_under(t, 0))) {
    for (int west = t.west; west <= t.east; west += 8) {
      if (!eight_columns_fit(t, field, west, t.south, t.north)) return false;
    }
    return true;
  }
  // Coded samples may fail where a larger square's plane is certain: so squares of the same tier are asked as on a GPU.
  const int tier = field.height && is_small(t) ? 0 : first_tier(t);
  return squares_fit(t, field, tier, squares_under(t, tier), EightAtOnce{});
}

struct HostTeam {
  template <class F>
  void each(int n, const F& f) {
    for (int i = 0; i < n; ++i) f(i);
  }
  /// Eight states at a time: of kClean and kDead the three low bits have an even sum, of others an odd one.
  template <class F>
  void each_open(const WindowView& w, int n, const F& f) {
    static_assert(kClean == 0 && kStale == 1 && kTouched == 2 && kDead == 3 && kReady == 4);
    for (int u = 0; u < n; u += 8) {
      std::uint64_t states;
      std::memcpy(&states, &w.state(u), 8);  // there are a few more places than vertices
      std::uint64_t open = (states ^ states >> 1 ^ states >> 2) & 0x0101010101010101u;
      for (; open != 0; open &= open - 1) {
        const int v = u + __builtin_ctzll(open) / 8;
        if (v < n) f(v);
      }
    }
  }
  void sync() {}
  std::int32_t place(std::int32_t* counter) { return (*counter)++; }
  void evaluate(const WindowView& w, int n) {
    for (int i = 0; i < n; ++i) evaluate_whole_ring(w, w.to_evaluate(i));
  }
  template <class Work>
  void measure(const WindowView&, const Field& field, int n, const Work& work) {
    for (int i = 0; i < n; ++i) {
      if (work.has_failed(i)) continue;
      for (int k = 0; k < work.count(i); ++k) {
        if (fits(work.triangle(i, k), field)) continue;
        work.fail(i);
        break;
      }
    }
  }
  template <class Work>
  void pull(const WindowView& w, const Field& field, int n, const Work& work) {
    for (int i = 0; i < n; ++i) {
      Pull pull;
      for (int k = 0; k < work.count(i); ++k) {
        const PullBox box = work.box(i, k);
        const int tier = first_tier(box.t);
        const bool plain = field.height && !has_void(field, squares_under(box.t, tier), tier);
        const Pull part = plain ? eight_columns_pull(box, field) : box.all(field);
        pull.sum += part.sum;
        pull.weight += part.weight;
      }
      w.pull(work.vertex(i)) = pull.sum;
      w.pull_weight(work.vertex(i)) = pull.weight;
    }
  }
};

}  // namespace cordillera::gpu::exact
