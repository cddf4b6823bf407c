#pragma once
// A pass of flips over the whole mesh: a few rounds of those that do not touch each other.
#include "gpu/fit/steps/flip_steps.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Turner {
 public:
  Turner(Device& device, WorkMesh<Device>& work) : device_(device), work_(work) {}

  template <class Samples>
  void pass(const Samples& samples, int rounds, ErrorLimit limit) {
    const std::size_t all = work_.ids();
    const FitMesh mesh = work_.mesh();
    const WaveView wave = work_.wave();
    std::uint32_t *const list = work_.room(list_, all), *const winners = work_.room(winners_, all);
    device_.each(all, MakeAllStale{mesh, wave});
    for (std::uint32_t round = 0; round < static_cast<std::uint32_t>(rounds); ++round) {
      const Vertices stale = device_.list({all}, IsMarked{wave, kStale}, list);
      device_.each_star(stale, work_.crowd(), EvaluateFlips<Samples>{mesh, wave, samples, limit});
      const Vertices wanting = device_.list({all}, WantsFlip{mesh, wave}, list);
      const Flip flip{mesh, wave};
      device_.each_of(wanting, OfferClaim<Flip>{flip, round});
      device_.each_of(wanting, DecideClaim<Flip>{flip, round});
      device_.each_of(device_.list(wanting, IsWinner{wave}, winners), flip);
    }
  }

 private:
  Device& device_;
  WorkMesh<Device>& work_;
  typename Device::template Array<std::uint32_t> list_, winners_;
};

}  // namespace cordillera::gpu::fit
