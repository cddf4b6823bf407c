#pragma once
// Flips and insertions change the rows of three or four vertices. Those of a round that are the first in order at all of them go
// ahead together. They share the arrays of the waves, which start anew afterwards.
#include "gpu/fit/steps/lock_steps.h"

namespace cordillera::gpu::fit {

/// The vertices whose rows a change writes.
struct Claimed {
  std::uint32_t vertex[4];
  int count = 0;
};

CORDILLERA_HD inline std::uint64_t claim_key(const FitMesh& mesh, const WaveView& wave, std::uint32_t u, std::uint32_t round) {
  return (std::uint64_t{0xffffu - round} << 48) | bid_key(mesh, wave, u);
}

/// Change: claimed(u) names the vertices of what u intends.
template <class Change>
struct OfferClaim {
  Change change;
  std::uint32_t round;
  CORDILLERA_HD void operator()(std::uint32_t u) const {
    const Claimed claimed = change.claimed(u);
    const std::uint64_t key = claim_key(change.mesh, change.wave, u, round);
    for (int k = 0; k < claimed.count; ++k) lower_to(change.wave.lock + claimed.vertex[k], key);
  }
};

template <class Change>
struct DecideClaim {
  Change change;
  std::uint32_t round;
  CORDILLERA_HD void operator()(std::uint32_t u) const {
    const Claimed claimed = change.claimed(u);
    const std::uint64_t key = claim_key(change.mesh, change.wave, u, round);
    for (int k = 0; k < claimed.count; ++k) {
      if (change.wave.lock[claimed.vertex[k]] != key) return;
    }
    change.wave.mark[u] |= kWinner;
  }
};

struct MakeAllStale {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD void operator()(std::size_t v) const {
    wave.mark[v] = mesh.vertex[v].gone() ? std::uint8_t{0} : std::uint8_t{kStale};
    wave.cost[v] = kNever;
    wave.lock[v] = ~std::uint64_t{0};
  }
};

struct IsMarked {
  WaveView wave;
  std::uint8_t mark;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return (wave.mark[v] & mark) != 0; }
};

CORDILLERA_HD inline std::uint32_t place_in_row(const FitMesh& mesh, std::uint32_t v, std::uint32_t neighbour) {
  std::uint32_t i = 0;
  while (mesh.row(v)[i] != neighbour) ++i;
  return i;
}
CORDILLERA_HD inline void drop_from_row(const FitMesh& mesh, std::uint32_t v, std::uint32_t neighbour) {
  std::uint32_t* const row = mesh.row(v);
  for (std::uint32_t i = place_in_row(mesh, v, neighbour); i + 1 < mesh.vertex[v].valence; ++i) row[i] = row[i + 1];
  --mesh.vertex[v].valence;
}
CORDILLERA_HD inline void put_into_row(const FitMesh& mesh, std::uint32_t v, std::uint32_t after, std::uint32_t neighbour) {
  std::uint32_t* const row = mesh.row(v);
  const std::uint32_t at = place_in_row(mesh, v, after) + 1;
  for (std::uint32_t i = mesh.vertex[v].valence; i > at; --i) row[i] = row[i - 1];
  row[at] = neighbour;
  ++mesh.vertex[v].valence;
}

}  // namespace cordillera::gpu::fit
