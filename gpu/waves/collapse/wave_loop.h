#pragma once
// The waves of one window. A Team is a block of threads with barriers, or one host thread with a plain loop:
//   each(n, f)            f(i) for i in 0..n-1
//   sort_out(n, classify, lists)   fills the lists anew: u goes to those whose bit classify(u) has set
//   barrier()
#include "gpu/waves/collapse/collapse.h"
#include "gpu/waves/collapse/star.h"

namespace cordillera::gpu {

/// Waves of a window, in a pass: at least; at most; and between, as long as a wave touches one vertex in so many.
inline constexpr int kLeastWaves = 3, kMostWaves = 96, kIdleShare = 24;

inline constexpr int kWaveLists = 3;
enum WaveList {
  kTouchedList,   ///< the ring changed in the last wave
  kStaleList,     ///< key under the threshold, to be evaluated first
  kUpToDateList,  ///< key under the threshold
};

/// Lists of local vertices, in window storage. Candidates are the stale ones, from the front, and those that are up to date, from
/// the back.
struct WaveLists {
  std::uint16_t* touched = nullptr;
  std::uint16_t* candidates = nullptr;
  int capacity = 0;
  std::uint64_t* counts = nullptr;  ///< 16 bits a list; two, in turn, so that one can be cleared while the other is read

  CORDILLERA_HD int size(WaveList k) const { return static_cast<int>((*counts >> (16 * k)) & 0xffffu); }
  CORDILLERA_HD void set(WaveList k, int place, int u) const {
    std::uint16_t* const list = k == kTouchedList ? touched : candidates;
    list[k == kUpToDateList ? capacity - 1 - place : place] = static_cast<std::uint16_t>(u);
  }
};

/// Which lists a vertex belongs to in the coming wave. Lazy: a vertex whose ring changed keeps its old key as an estimate and is
/// evaluated again only when that key is under the threshold.
struct Classify {
  WindowView w;
  std::uint32_t threshold;
  int touched;
  CORDILLERA_HD unsigned operator()(int u) const { return lists(w.state[u], w.key[u]); }
  CORDILLERA_HD unsigned lists(std::uint8_t state, std::uint32_t key) const {
    if (state == kDead) return 0;
    unsigned lists = state == touched ? 1u << kTouchedList : 0u;
    // A blocked vertex gets another chance when its surroundings change.
    const bool retry = key == kBlocked && state == touched;
    if (key < threshold || retry) lists |= 1u << (state == kClean ? kUpToDateList : kStaleList);
    return lists;
  }
};

struct EvaluateListed {
  WindowView w;
  Rules rules;
  const std::uint16_t* list;
  CORDILLERA_HD void operator()(int i) const {
    const int u = list[i];
    w.state[u] = kClean;
    if (w.small && w.inside)
      Evaluate<float, true>{w, rules}(u);
    else if (w.small)
      Evaluate<float>{w, rules}(u);
    else
      Evaluate<std::int32_t>{w, rules}(u);
  }
};
struct DecideListed {
  Decide decide;
  const std::uint16_t* list;
  int stale;
  int skip;  ///< from the end of the stale ones to the others
  CORDILLERA_HD void operator()(int i) const { decide(list[i < stale ? i : i + skip]); }
};
struct GatherListed {
  Gather gather;
  const std::uint16_t* list;
  CORDILLERA_HD void operator()(int i) const { gather(list[i]); }
};

/// Runs all waves over the first `count` vertices of the window. One threshold for all, so that windows need no talk with each
/// other: a window keeps what its terrain needs. The least key around goes first, and that is order enough.
template <class Team>
CORDILLERA_HD void run_waves(Team& team, const WindowView& w, WaveLists& lists, int count, const Rules& rules) {
  const std::uint32_t threshold = key_limit(rules.cost);
  team.sort_out(count, Classify{w, threshold, -1}, lists);
  for (int wave = 0;; ++wave) {
    team.barrier();
    const int stale = lists.size(kStaleList), candidates = stale + lists.size(kUpToDateList);
    if (stale > 0) {
      team.each(stale, EvaluateListed{w, rules, lists.candidates});
      team.barrier();
    }
    team.each(candidates, DecideListed{{w, threshold, wave}, lists.candidates, stale, lists.capacity - candidates});
    team.barrier();
    team.sort_out(count, Classify{w, threshold, kTouched + wave}, lists);
    team.barrier();
    const int touched = lists.size(kTouchedList);
    team.each(touched, GatherListed{{w}, lists.touched});
    if (wave + 1 >= kMostWaves || (wave + 1 >= kLeastWaves && kIdleShare * touched < count)) return;
  }
}

}  // namespace cordillera::gpu
