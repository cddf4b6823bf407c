#pragma once
// A sweep moves every vertex once, in the order of a hash; vertices that are no neighbours move at the same time
// (Jones-Plassmann).
#include "gpu/device/bits.h"
#include "gpu/fit/steps/relocate.h"

namespace cordillera::gpu::fit {

struct IsAlive {
  const Vertex* vertex;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return !vertex[v].gone(); }
};

struct IsGone {
  const Vertex* vertex;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return vertex[v].gone(); }
};

struct MakeWait {
  std::uint8_t* waiting;
  CORDILLERA_HD void operator()(std::uint32_t v) const { waiting[v] = 1; }
};

/// A vertex waits for neighbours that come before it. The order differs from sweep to sweep.
struct IsNext {
  FitMesh mesh;
  const std::uint8_t* waiting;
  std::uint32_t sweep;

  CORDILLERA_HD std::uint32_t turn_of(std::uint32_t v) const { return hash32(v ^ sweep); }
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    const std::uint32_t mine = turn_of(v);
    const std::uint32_t* const row = mesh.row(v);
    for (std::uint32_t k = 0; k < mesh.vertex[v].valence; ++k) {
      if (waiting[row[k]] && turn_of(row[k]) < mine) return false;
    }
    return true;
  }
};

/// Its turn: it moves, and nobody waits for it any more.
template <class Move>
struct TakeTurn {
  Move move;
  std::uint8_t* waiting;
  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t v) const {
    move(lanes, v);
    if (lanes.leads()) waiting[v] = 0;
  }
};

}  // namespace cordillera::gpu::fit
