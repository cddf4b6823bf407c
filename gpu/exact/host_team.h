#pragma once
// The team of a host: one thread, plain loops; samples eight at a time. See window_pass.h.
#include <cstring>

#include "gpu/exact/collapse.h"
#include "gpu/exact/heights.h"
#include "gpu/exact/squares.h"

namespace cordillera::gpu::exact {

/// A row of a square of 8, at once.
class RowOfEight {
 public:
  using Floats = float __attribute__((vector_size(32)));
  using Ints = std::int32_t __attribute__((vector_size(32)));

  RowOfEight(const Triangle& t, int x) : t_(t) {
    const Ints lane = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int k = 0; k < 3; ++k) edge_[k] = t.across[k] * lane + t.across[k] * (x - t.ex[k]);
    const Ints column = lane + (x - t.ex[0]);
    const Floats u = __builtin_convertvector(column, Floats);
    rise_ = t.dx * u + t.bend_x * (u * u);
  }
  /// Are the samples under the triangle within its tolerance?
  bool fits(const float* sample, int y) const {
    Ints inside = {};
    for (int k = 0; k < 3; ++k) inside |= edge_[k] + t_.along[k] * (y - t_.ey[k]);
    Floats height;
    std::memcpy(&height, sample, sizeof height);
    const Floats off = (t_.height - height) + (rise_ + t_.rise_up(static_cast<float>(y - t_.ey[0])));
    const Ints bad = ((off > t_.tolerance) | (off < -t_.tolerance)) & (inside >= 0);
    std::uint64_t any[4];
    std::memcpy(any, &bad, sizeof any);
    return (any[0] | any[1] | any[2] | any[3]) == 0;
  }

 private:
  const Triangle& t_;
  Ints edge_[3];
  Floats rise_;
};

struct EightAtOnce {
  bool operator()(const Triangle& t, const Field& field, int sx, int sy) const {
    if (!t.published || (field.depth && has_deep_void(field.tier_depth[0][sy * field.tier_stride[0] + sx], -1)))
      return samples_fit(t, field, sx, sy);
    const RowOfEight row(t, 8 * sx);
    const int north = least(8 * sy + 7, t.north);
    for (int y = greatest(8 * sy, t.south); y <= north; ++y) {
      if (!row.fits(field.height + field.index(8 * sx, y), y)) return false;
    }
    return true;
  }
};

/// All samples under a triangle.
inline bool fits(const Triangle& t, const Field& field) {
  if (!can_fit(t)) return false;
  const int tier = is_small(t) ? 0 : first_tier(t);
  return squares_fit(t, field, tier, squares_under(t, tier), EightAtOnce{});
}

struct HostTeam {
  template <class F>
  void each(int n, const F& f) {
    for (int i = 0; i < n; ++i) f(i);
  }
  void sync() {}
  std::int32_t place(std::int32_t* counter) { return (*counter)++; }
  void evaluate(const WindowView& w, int n) {
    for (int i = 0; i < n; ++i) exact::evaluate(w, w.to_evaluate(i), AloneLane{});
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
        for (int q = 0; q < box.count; ++q) box.add(field, q % box.columns, q / box.columns, pull);
      }
      w.pull(work.vertex(i)) = pull.sum;
      w.pull_weight(work.vertex(i)) = pull.weight;
    }
  }
};

}  // namespace cordillera::gpu::exact
