#pragma once
// Sweeps: every vertex moved once to where it fits better.
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Sweeper {
 public:
  Sweeper(Device& device, WorkMesh<Device>& work) : device_(device), work_(work) {}

  template <class Move>
  void sweep(const Move& move) {
    const std::span<const std::uint32_t> all = work_.alive();
    std::uint8_t* const waiting = work_.room(waiting_, work_.ids());
    std::uint32_t *rest = work_.room(rest_[0], all.size()), *spare = work_.room(rest_[1], all.size()),
                  *next = work_.room(next_, all.size());
    device_.each(all.size(), SetByte{waiting, all.data(), 1});
    const std::uint32_t* list = all.data();
    for (std::size_t left = all.size(); left > 0; std::swap(rest, spare)) {
      const std::size_t count = device_.select(left, IsNext{work_.mesh(), waiting, list, sweeps_}, next);
      device_.each(count, PickFrom{list, next});
      device_.each(count, Listed{move, next});
      device_.each(count, SetByte{waiting, next, 0});
      left = device_.select(left, IsWaiting{waiting, list}, rest);
      device_.each(left, PickFrom{list, rest});
      list = rest;
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
