#pragma once
// What the waves keep for every vertex, and the order of costs.
#include "gpu/device/atomic.h"
#include "gpu/fit/steps/edge_quadric.h"

namespace cordillera::gpu::fit {

/// What a vertex would do.
struct Intent {
  Point at;
  float z;
  std::uint32_t slot;  ///< of its row: the neighbour that it collapses with
};

enum WaveMark : std::uint8_t {
  kStale = 1,    ///< the cost is an estimate from before its surroundings changed
  kTouched = 2,  ///< its ring or its planes change in this wave
  kWinner = 4,
};

/// Indexed by vertex.
struct WaveView {
  float* cost = nullptr;
  Intent* intent = nullptr;
  std::uint8_t* mark = nullptr;
  Planes* planes = nullptr;
  std::uint64_t* lock = nullptr;   ///< least key of an edge at it; the round's number on top makes those of earlier rounds lose
  std::uint32_t* spent = nullptr;  ///< the last wave in which a winner had it as an end, or beside one
  std::uint32_t* into = nullptr;   ///< of those that are gone: the vertex that they became
};

/// Floats as integers of the same order.
CORDILLERA_HD inline std::uint32_t ordered(float value) {
  union {
    float f;
    std::uint32_t bits;
  } as{value};
  return as.bits & 0x80000000u ? ~as.bits : as.bits | 0x80000000u;
}

CORDILLERA_HD inline float unordered(std::uint32_t bits) {
  union {
    std::uint32_t bits;
    float f;
  } as{bits & 0x80000000u ? bits & 0x7fffffffu : ~bits};
  return as.f;
}

/// Classes of cost: a histogram's bins, eight to a factor of two.
inline constexpr std::uint32_t kCostClasses = 4096;
CORDILLERA_HD inline std::uint32_t cost_class(float cost) { return ordered(cost) >> 20; }

struct ClassOfCost {
  WaveView wave;
  CORDILLERA_HD std::uint32_t operator()(std::size_t v) const {
    return wave.cost[v] < kNever ? cost_class(wave.cost[v]) : kCostClasses;
  }
};

}  // namespace cordillera::gpu::fit
