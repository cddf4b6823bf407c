#pragma once
// Sweeps: every vertex moved once to where it fits better.
#include <utility>

#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Sweeper {
 public:
  Sweeper(Device& device, WorkMesh<Device>& work) : device_(device), work_(work) {}

  template <class Move>
  void sweep(const Move& move) {
    const std::size_t all = work_.ids();
    std::uint8_t* const waiting = work_.room(waiting_, all);
    std::uint32_t *rest = work_.room(rest_[0], all), *spare = work_.room(rest_[1], all), *next = work_.room(next_, all);
    Vertices left = device_.list({all}, IsAlive{work_.mesh().vertex}, rest);
    device_.each_of(left, MakeWait{waiting});
    auto watch = device_.template watch<std::uint32_t>();
    for (bool done = false; !done; std::swap(rest, spare)) {
      const Split turns = device_.split(left, IsNext{work_.mesh(), waiting, sweeps_}, next, spare);
      device_.each_star(turns.yes, work_.crowd(), TakeTurn<Move>{move, waiting});
      left = turns.no;
      done = left.count.found ? watch.look(left.count.found) == 0u : left.count.most == 0;
    }
    ++sweeps_;
  }

 private:
  Device& device_;
  WorkMesh<Device>& work_;
  std::uint32_t sweeps_ = 0;
  typename Device::template Array<std::uint8_t> waiting_;
  typename Device::template Array<std::uint32_t> rest_[2], next_;
};

}  // namespace cordillera::gpu::fit
