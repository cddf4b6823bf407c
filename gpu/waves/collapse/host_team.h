#pragma once
// The team of a host: one thread, plain loops. See wave_loop.h.
#include "gpu/waves/collapse/wave_loop.h"

namespace cordillera::gpu {

struct HostTeam {
  template <class Count, class F>
  void each(Count n, const F& f) {
    for (Count i = 0; i < n; ++i) f(i);
  }
  template <class Classify>
  void sort_out(int n, const Classify& classify, const WaveLists& lists) {
    std::uint64_t counts[3] = {};
    for (int u = 0; u < n; ++u) {
      const unsigned in = classify(u);
      for (unsigned k = 0; k < 3; ++k) {
        if ((in >> k) & 1u) lists.set(static_cast<WaveList>(k), static_cast<int>(counts[k]++), u);
      }
    }
    *lists.counts = counts[0] | counts[1] << 16 | counts[2] << 32;
  }
  void barrier() {}
};

}  // namespace cordillera::gpu
