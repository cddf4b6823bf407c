#pragma once
// The team of a host: one thread, plain loops. See wave_loop.h.
#include "gpu/wave_loop.h"

namespace cordillera::gpu {

struct HostTeam {
  template <class Count, class F>
  void each(Count n, const F& f) {
    for (Count i = 0; i < n; ++i) f(i);
  }
  template <class Classify>
  void sort_out(int n, const Classify& classify, const WaveLists& lists) {
    int touched = 0, candidates = 0, stale = 0;
    for (int u = 0; u < n; ++u) {
      const unsigned in = classify(u);
      if (in & kTouchedList) lists.touched[touched++] = static_cast<std::uint16_t>(u);
      if (in & kCandidateList) lists.candidates[candidates++] = static_cast<std::uint16_t>(u);
      if (in & kStaleList) lists.stale[stale++] = static_cast<std::uint16_t>(u);
    }
    lists.counts[0] = touched;
    lists.counts[1] = candidates;
    lists.counts[2] = stale;
  }
  void barrier() {}
};

}  // namespace cordillera::gpu
