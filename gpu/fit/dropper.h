#pragma once
// The first part of a great reduction: waves that drop vertices onto neighbours, at a fraction of what an optimal place costs.
// First inside blocks, all waves of one while a cache holds it, then over the whole mesh.
#include "gpu/fit/drop_block.h"
#include "gpu/fit/threshold.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Dropper {
 public:
  Dropper(Device& device, WorkMesh<Device>& work) : device_(device), work_(work), threshold_(device) {}

  /// Until so many triangles are left, or fewer by what a wave takes; never below `least`. Leaves carried planes at every vertex.
  void drop(std::uint64_t about, std::uint64_t least) {
    device_.each(work_.ids(), StartDrops{work_.mesh(), work_.wave()});
    wave_number_ = 0;
    if (work_.blocks() > 0) in_blocks(least);
    while (work_.triangles() > about && wave(least)) {
    }
  }

 private:
  template <class T>
  using Array = typename Device::template Array<T>;
  using List = std::span<const std::uint32_t>;

  static constexpr double kPool = 0.5, kFirstPool = 0.8;
  static constexpr int kBlockWaves = 10;
  static constexpr std::uint32_t kClassGrowth = 5;

  void in_blocks(std::uint64_t least);
  bool wave(std::uint64_t least);
  List find_winners(List candidates, std::uint32_t limit);

  Device& device_;
  WorkMesh<Device>& work_;
  Threshold<Device> threshold_;
  std::uint32_t wave_number_ = 0;
  Array<std::uint32_t> listed_, least_, winners_, dropped_;
};

/// Blocks cannot ask each other what is cheap: all go by a share of the first costs.
template <class Device>
void Dropper<Device>::in_blocks(std::uint64_t least) {
  const MeshView mesh = work_.mesh();
  const WaveView wave = work_.wave();
  const std::size_t all = work_.ids(), blocks = work_.blocks();
  const double most_share = static_cast<double>(work_.triangles() - least) / 2 / static_cast<double>(all);
  const BlockSchedule schedule{kBlockWaves, threshold_.of_share(wave, all, kFirstPool), kClassGrowth, most_share};
  std::uint32_t* const dropped = work_.room(dropped_, blocks);
  device_.zero(dropped, blocks);
  device_.each_block(blocks, DropInBlock{mesh, wave, schedule, work_.block_start(), dropped});
  const auto gone = static_cast<std::int64_t>(all - work_.alive().size());
  work_.count(-gone, -2 * gone);
  device_.each(all, Unlock{mesh, wave});
  wave_number_ = kBlockWaves;
}

template <class Device>
bool Dropper<Device>::wave(std::uint64_t least) {
  if (work_.close_up()) wave_number_ = 0;
  ++wave_number_;
  const MeshView mesh = work_.mesh();
  const WaveView wave = work_.wave();
  const std::size_t all = work_.ids();
  std::uint32_t* const listed = work_.room(listed_, all);
  const auto evaluate_under = [&](std::uint32_t most_class) {
    const std::size_t stale = device_.select(all, IsStaleUnder{wave, most_class}, listed);
    device_.each(stale, Listed{EvaluateDrop{mesh, wave}, listed});
  };
  evaluate_under(cost_class(-kNever));  // nobody knows anything of these
  const std::uint32_t limit = threshold_.of_share(wave, all, kPool);
  evaluate_under(limit);
  const List candidates{listed, device_.select(all, IsCandidateUnder{wave, limit}, listed)};
  const List winners = find_winners(candidates, limit);
  if (winners.empty() || work_.triangles() < least + 2 * winners.size()) return false;

  device_.each(winners.size(), Listed{Drop{mesh, wave, wave_number_}, winners.data()});
  const std::size_t touched = device_.select(all, WasTouched{wave, wave_number_}, listed);
  device_.each(touched, Listed{CloseRing{mesh, wave}, listed});
  const auto count = static_cast<std::int64_t>(winners.size());
  work_.count(-count, -2 * count);
  return true;
}

template <class Device>
typename Dropper<Device>::List Dropper<Device>::find_winners(List candidates, std::uint32_t limit) {
  const MeshView mesh = work_.mesh();
  const WaveView wave = work_.wave();
  std::uint32_t* const least = work_.room(least_, candidates.size());
  const std::size_t least_count =
      device_.select(candidates.size(), OfList{IsLeast{mesh, wave, limit}, candidates.data()}, least);
  device_.each(least_count, PickFrom{candidates.data(), least});
  device_.each(least_count, Listed{MarkPossible{mesh, wave}, least});
  std::uint32_t* const winners = work_.room(winners_, least_count);
  const std::size_t count = device_.select(least_count, OfList{IsFirstSuitor{mesh, wave}, least}, winners);
  device_.each(count, PickFrom{least, winners});
  device_.each(least_count, Listed{ForgetPossible{wave}, least});
  return {winners, count};
}

}  // namespace cordillera::gpu::fit
