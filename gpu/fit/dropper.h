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
    for (bool stuck = false; !stuck && work_.triangles() > about;) {
      if (work_.close_up()) wave_number_ = 0;
      stuck = work_.until_halt(least, about, [&](Progress* progress) { wave(progress); }).halt == Halt::stuck;
    }
  }

 private:
  template <class T>
  using Array = typename Device::template Array<T>;

  static constexpr double kPool = 0.5, kFirstPool = 0.8;
  static constexpr int kBlockWaves = 10;
  static constexpr std::uint32_t kClassGrowth = 5;

  void in_blocks(std::uint64_t least);
  void wave(Progress* progress);

  Device& device_;
  WorkMesh<Device>& work_;
  Threshold<Device> threshold_;
  std::uint32_t wave_number_ = 0;
  Array<std::uint32_t> listed_, least_, winners_, dropped_;
};

/// Blocks cannot ask each other what is cheap: all go by a share of the first costs.
template <class Device>
void Dropper<Device>::in_blocks(std::uint64_t least) {
  const FitMesh mesh = work_.mesh();
  const WaveView wave = work_.wave();
  const std::size_t all = work_.ids(), blocks = work_.blocks();
  const double most_share = static_cast<double>(work_.triangles() - least) / 2 / static_cast<double>(all);
  const Count first_class = threshold_.of_share(wave, all, kFirstPool, work_.fresh_progress());
  std::uint32_t* const dropped = work_.room(dropped_, blocks);
  device_.zero(dropped, blocks);
  const BlockSchedule schedule{kBlockWaves, first_class, kClassGrowth, most_share};
  device_.each_block(blocks, DropInBlock{mesh, wave, schedule, work_.block_start(), dropped});
  const Vertices gone = device_.list({all}, IsGone{mesh.vertex}, work_.room(listed_, all));
  const auto count = static_cast<std::int64_t>(device_.value(gone.count));
  work_.count(-count, -2 * count);
  device_.each(all, Unlock{mesh, wave});
  wave_number_ = kBlockWaves;
}

template <class Device>
void Dropper<Device>::wave(Progress* progress) {
  ++wave_number_;
  const FitMesh mesh = work_.mesh();
  const WaveView wave = work_.wave();
  const std::size_t all = work_.ids();
  std::uint32_t *const listed = work_.room(listed_, all), *const least = work_.room(least_, all);
  const auto evaluate_under = [&](Count most_class) {
    device_.each_of(device_.list({all}, IsStaleUnder{wave, most_class}, listed), EvaluateDrop{mesh, wave});
  };
  evaluate_under({cost_class(-kNever)});  // nobody knows anything of these
  const Count limit = threshold_.of_share(wave, all, kPool, progress);
  evaluate_under(limit);
  const Vertices candidates = device_.list({all}, IsCandidateUnder{wave, limit}, listed);
  const Vertices first = device_.list(candidates, IsLeast{mesh, wave, limit}, least);
  device_.each_of(first, MarkPossible{mesh, wave});
  const Vertices winners = device_.list(first, IsFirstSuitor{mesh, wave}, work_.room(winners_, all));
  device_.each_of(first, ForgetPossible{wave});
  device_.each(1, CommitDrops{progress, winners.count});
  device_.each_of({{winners.count.most, &progress->going}, winners.list}, Drop{mesh, wave, wave_number_});
  device_.each_of(device_.list({all}, WasTouched{wave, wave_number_}, listed), CloseRing{mesh, wave});
}

}  // namespace cordillera::gpu::fit
