#pragma once
// A pass of flips over the whole mesh: a few rounds of those that do not touch each other.
#include "gpu/fit/flip_steps.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Turner {
 public:
  Turner(Device& device, WorkMesh<Device>& work) : device_(device), work_(work) {}

  template <class Samples>
  void pass(const Samples& samples, int rounds, ErrorLimit limit) {
    const std::size_t all = work_.ids();
    const MeshView mesh = work_.mesh();
    const WaveView wave = work_.wave();
    device_.each(all, MakeAllStale{mesh, wave});
    for (std::uint32_t round = 0; round < static_cast<std::uint32_t>(rounds); ++round) {
      std::uint32_t* const list = work_.room(list_, all);
      std::uint32_t* const winners = work_.room(winners_, all);
      const std::size_t stale = device_.select(all, IsMarked{wave, kStale}, list);
      device_.each(stale, EvaluateFlips<Samples>{mesh, wave, samples, limit, list});
      const std::size_t count = device_.select(all, WantsFlip{mesh, wave}, list);
      if (count == 0) return;
      const Flip flip{mesh, wave, winners};
      device_.each(count, OfferClaim<Flip>{flip, round, list});
      device_.each(count, DecideClaim<Flip>{flip, round, list});
      const std::size_t won = device_.select(count, IsWinner{wave, list}, winners);
      device_.each(won, PickFrom{list, winners});
      device_.each(won, flip);
    }
  }

 private:
  Device& device_;
  WorkMesh<Device>& work_;
  typename Device::template Array<std::uint32_t> list_, winners_;
};

}  // namespace cordillera::gpu::fit
