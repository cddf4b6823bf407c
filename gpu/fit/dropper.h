#pragma once
// The first part of a great reduction: waves that drop vertices onto neighbours, at a fraction of what an optimal place costs. The
// planes of those that go are carried along, so that later waves still know of them.
#include "gpu/fit/collapse_steps.h"
#include "gpu/fit/drop_steps.h"
#include "gpu/fit/lock_steps.h"
#include "gpu/fit/threshold.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Dropper {
 public:
  Dropper(Device& device, WorkMesh<Device>& work) : device_(device), work_(work), threshold_(device) {}

  /// Until about so many triangles are left, in steps of a wave; never below `least`. Leaves carried planes at every vertex.
  void drop(std::uint64_t about, std::uint64_t least, double pool) {
    device_.each(work_.ids(), StartVertex{work_.mesh(), work_.wave()});
    wave_number_ = 0;
    while (work_.triangles() > about && wave(least, pool)) {
    }
  }

 private:
  int kRounds = getenv("DR") ? atoi(getenv("DR")) : 3;
  template <class T>
  using Array = typename Device::template Array<T>;

  bool wave(std::uint64_t least, double pool);
  std::size_t round(const std::uint32_t* candidates, std::size_t candidate_count, std::uint32_t* winners);

  Device& device_;
  WorkMesh<Device>& work_;
  Threshold<Device> threshold_;
  std::uint32_t wave_number_ = 0;
  Array<std::uint32_t> stale_, candidates_, least_, winners_, touched_;
};

template <class Device>
bool Dropper<Device>::wave(std::uint64_t least, double pool) {
  if (work_.close_up()) wave_number_ = 0;
  ++wave_number_;
  const MeshView mesh = work_.mesh();
  const WaveView wave = work_.wave();
  const std::size_t all = work_.ids();
  const std::uint32_t most = wave_number_ == 1 ? kCostClasses : threshold_.of_share(wave, all, pool);
  std::uint32_t* const stale = work_.room(stale_, all);
  const std::size_t stale_count = device_.select(all, IsStaleUnder{wave, most}, stale);
  device_.each(stale_count, Listed{EvaluateDrop{mesh, wave}, stale});
  const std::uint32_t limit = wave_number_ == 1 ? threshold_.of_share(wave, all, pool) : most;

  std::uint32_t* const candidates = work_.room(candidates_, all);
  const std::size_t candidate_count = device_.select(all, IsCandidateUnder{wave, limit}, candidates);
  std::uint32_t* const winners = work_.room(winners_, candidate_count);
  std::size_t count = 0;
  for (int k = 0; k < kRounds; ++k) count += round(candidates, candidate_count, winners + count);
  const std::size_t touched = device_.select(all, WasTouched{wave, wave_number_}, work_.room(touched_, all));
  device_.each(touched, Listed{CloseRing{mesh, wave}, touched_.data()});
  work_.count(-static_cast<std::int64_t>(count), -2 * static_cast<std::int64_t>(count));
  return count > 0;
}

template <class Device>
std::size_t Dropper<Device>::round(const std::uint32_t* candidates, std::size_t candidate_count, std::uint32_t* winners) {
  const MeshView mesh = work_.mesh();
  const WaveView wave = work_.wave();
  std::uint32_t* const least = work_.room(least_, candidate_count);
  const std::size_t least_count = device_.select(candidate_count, IsLeast{mesh, wave, candidates, wave_number_}, least);
  device_.each(least_count, PickFrom{candidates, least});
  device_.each(least_count, Listed{MarkPossible{mesh, wave}, least});
  const std::size_t count = device_.select(least_count, IsFirstSuitor{mesh, wave, least}, winners);
  device_.each(count, PickFrom{least, winners});
  device_.each(least_count, Listed{ForgetPossible{wave}, least});
  device_.each(count, Listed{Drop{mesh, wave, wave_number_}, winners});
  return count;
}

}  // namespace cordillera::gpu::fit
