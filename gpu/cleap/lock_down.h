#pragma once
// Mutual exclusion (section 4.4, Algorithm 5): a candidate must hold every triangle of its vicinity. What is written into a flag
// is the candidate's number in the window, from 1 on: the text says the thread's, its listing the edge's; no result depends on
// which.
//
// Ordered (ours, the default): each flag ends with the least number that asked for it; who finds another's number in its vicinity
// has lost. Raced (as published): compare-and-swap, first come first served, released on failure; depends on timing.
#include "gpu/cleap/candidate.h"
#include "gpu/device/atomic.h"

namespace cordillera::gpu::cleap {

CORDILLERA_HD inline void lower_flag(std::uint32_t* at, std::uint32_t value) {
#ifdef __CUDA_ARCH__
  atomicMin(at, value);
#else
  std::uint32_t before = __atomic_load_n(at, __ATOMIC_RELAXED);
  while (value < before && !__atomic_compare_exchange_n(at, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#endif
}
/// atomicCAS: what was there.
CORDILLERA_HD inline std::uint32_t swap_flag(std::uint32_t* at, std::uint32_t expected, std::uint32_t value) {
#ifdef __CUDA_ARCH__
  return atomicCAS(at, expected, value);
#else
  __atomic_compare_exchange_n(at, &expected, value, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE);
  return expected;
#endif
}
/// Threads that release the same triangle write the same; nobody reads meanwhile.
CORDILLERA_HD inline void set_flag(std::uint32_t* at, std::uint32_t value) {
#ifdef __CUDA_ARCH__
  *at = value;
#else
  __atomic_store_n(at, value, __ATOMIC_RELAXED);
#endif
}

CORDILLERA_HD inline std::uint32_t number_of(std::size_t candidate) { return static_cast<std::uint32_t>(candidate) + 1; }

struct ClaimOrdered {
  Arrays mesh;
  Window window;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (!goes(window.fate[i])) return;
    all_in_vicinity(mesh, mesh.edge[window.edge[i]], [&](std::int32_t triangle) {
      lower_flag(mesh.flag + triangle, number_of(i));
      return true;
    });
  }
};
/// After all have claimed.
struct DecideOrdered {
  Arrays mesh;
  Window window;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (!goes(window.fate[i])) return;
    const bool holds_all = all_in_vicinity(mesh, mesh.edge[window.edge[i]],
                                           [&](std::int32_t triangle) { return mesh.flag[triangle] == number_of(i); });
    if (!holds_all) window.fate[i] = Fate::locked;
  }
};
struct LockRaced {
  Arrays mesh;
  Window window;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (!goes(window.fate[i])) return;
    const Edge& edge = mesh.edge[window.edge[i]];
    const std::uint32_t me = number_of(i);
    const bool holds_all = all_in_vicinity(mesh, edge, [&](std::int32_t triangle) {
      const std::uint32_t held = swap_flag(mesh.flag + triangle, kFree, me);
      return held == kFree || held == me;
    });
    if (holds_all) return;
    window.fate[i] = Fate::locked;
    all_in_vicinity(mesh, edge, [&](std::int32_t triangle) {
      swap_flag(mesh.flag + triangle, me, kFree);
      return true;
    });
  }
};

/// At the end of a window, before the mesh changes. Closing (Shontz and Nistor's marking): what a collapse touched stays taken
/// until the pass ends.
struct Release {
  Arrays mesh;
  Window window;
  bool closing;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (window.fate[i] == Fate::gone) return;
    const bool close = closing && goes(window.fate[i]);
    all_in_vicinity(mesh, mesh.edge[window.edge[i]], [&](std::int32_t triangle) {
      if (!closing)
        set_flag(mesh.flag + triangle, kFree);
      else if (get_shared(mesh.flag + triangle) == kClosed)
        return true;
      else if (close)
        set_flag(mesh.flag + triangle, kClosed);
      else
        swap_flag(mesh.flag + triangle, number_of(i), kFree);
      return true;
    });
  }
};

}  // namespace cordillera::gpu::cleap
