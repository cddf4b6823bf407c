#pragma once
// A sweep moves every vertex once, in the order of a hash; vertices that are no neighbours move at the same time
// (Jones-Plassmann).
#include "gpu/fit/relocate.h"

namespace cordillera::gpu::fit {

struct IsAlive {
  const Vertex* vertex;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return !vertex[v].gone(); }
};

struct IsGone {
  const Vertex* vertex;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return vertex[v].gone(); }
};

struct SetByte {
  std::uint8_t* byte;
  const std::uint32_t* list;
  std::uint8_t value;
  CORDILLERA_HD void operator()(std::size_t i) const { byte[list[i]] = value; }
};

/// A vertex waits for neighbours that come before it. The order differs from sweep to sweep.
struct IsNext {
  MeshView mesh;
  const std::uint8_t* waiting;
  const std::uint32_t* list;
  std::uint32_t sweep;

  CORDILLERA_HD std::uint32_t turn_of(std::uint32_t v) const { return mixed(v ^ sweep); }
  CORDILLERA_HD bool operator()(std::uint32_t i) const {
    const std::uint32_t v = list[i], mine = turn_of(v);
    const std::uint32_t* const row = mesh.row(v);
    for (std::uint32_t k = 0; k < mesh.vertex[v].valence; ++k) {
      if (waiting[row[k]] && turn_of(row[k]) < mine) return false;
    }
    return true;
  }
};

struct IsWaiting {
  const std::uint8_t* waiting;
  const std::uint32_t* list;
  CORDILLERA_HD bool operator()(std::uint32_t i) const { return waiting[list[i]] != 0; }
};

/// to[i] = list[to[i]]
struct PickFrom {
  const std::uint32_t* list;
  std::uint32_t* to;
  CORDILLERA_HD void operator()(std::size_t i) const { to[i] = list[to[i]]; }
};

}  // namespace cordillera::gpu::fit
