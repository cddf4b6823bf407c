#pragma once
// The waves of one window. A Team is a block of threads with barriers, or one host thread with a plain loop:
//   each(n, f)            f(i) for i in 0..n-1
//   sort_out(n, classify, lists)   appends u to the lists whose bit classify(u) has set
//   barrier()
#include "gpu/collapse.h"
#include "gpu/star.h"

namespace cordillera::gpu {

/// Thresholds grow by a fixed schedule up to the level's own, so windows need no talk with each other: a window keeps what its terrain needs.
struct WaveSchedule {
  float cost = 1;       ///< the level's threshold, metres^2 x cells
  float growth = 2.5f;  ///< from one wave to the next
  int growing = 8;      ///< waves with a growing threshold
  int settled = 3;      ///< waves at the level's threshold, at least
  int most = 96;        ///< waves at most; beyond the schedule only while they still move something

  CORDILLERA_HD float first() const {
    float f = cost;
    for (int k = 1; k < growing; ++k) f = f / growth;
    return f;
  }
};

/// Lists of local vertices, in window storage.
struct WaveLists {
  std::uint16_t* touched = nullptr;     ///< ring changed in the last wave
  std::uint16_t* candidates = nullptr;  ///< key under the threshold
  std::uint16_t* stale = nullptr;       ///< of these, the ones to evaluate first
  int* counts = nullptr;                ///< 3
};
inline constexpr unsigned kTouchedList = 1, kCandidateList = 2, kStaleList = 4;  ///< bits of Classify's answer

/// Which lists a vertex belongs to in the coming wave. Lazy: a vertex whose ring changed keeps its old key as an estimate and is
/// evaluated again only when that key is under the threshold.
struct Classify {
  WindowView w;
  std::uint32_t threshold;
  int touched;
  CORDILLERA_HD unsigned operator()(int u) const {
    const std::uint8_t state = w.state[u];
    if (state == kDead) return 0;
    unsigned lists = state == touched ? kTouchedList : 0u;
    // A blocked vertex gets another chance when its surroundings change.
    const bool retry = w.key[u] == kBlocked && state == touched;
    if (w.key[u] < threshold || retry) lists |= state == kClean ? kCandidateList : (kCandidateList | kStaleList);
    return lists;
  }
};

struct EvaluateListed {
  Evaluate evaluate;
  const std::uint16_t* list;
  CORDILLERA_HD void operator()(int i) const {
    const int u = list[i];
    evaluate.w.state[u] = kClean;
    evaluate(u);
  }
};
template <class Step>
struct Listed {
  Step step;
  const std::uint16_t* list;
  CORDILLERA_HD void operator()(int i) const { step(list[i]); }
};

/// Runs all waves over the first `count` vertices of the window.
template <class Team>
CORDILLERA_HD void run_waves(Team& team, const WindowView& w, const WaveLists& lists, int count, const Rules& rules,
                             const WaveSchedule& schedule) {
  float cost = schedule.first();
  std::uint32_t threshold = key_limit(cost);
  team.sort_out(count, Classify{w, threshold, -1}, lists);
  for (int wave = 0;; ++wave) {
    team.barrier();
    const int stale = lists.counts[2], candidates = lists.counts[1];
    team.each(stale, EvaluateListed{{w, rules}, lists.stale});
    team.barrier();
    team.each(candidates, Listed<Decide>{{w, threshold, wave}, lists.candidates});
    team.barrier();
    if (wave + 1 < schedule.growing) cost = wave + 2 == schedule.growing ? schedule.cost : cost * schedule.growth;
    threshold = key_limit(cost);
    team.sort_out(count, Classify{w, threshold, kTouched + wave}, lists);
    team.barrier();
    const int touched = lists.counts[0];
    team.each(touched, Listed<Gather>{{w}, lists.touched});
    team.barrier();
    const bool scheduled = wave + 1 < schedule.growing + schedule.settled;
    if (wave + 1 >= schedule.most || (!scheduled && 32 * touched < count)) return;
  }
}

}  // namespace cordillera::gpu
