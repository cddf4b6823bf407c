#pragma once
// Insertion of the worst samples, up to a count.
#include <algorithm>

#include "gpu/fit/cutter.h"
#include "gpu/fit/steps/insert_steps.h"
#include "gpu/fit/threshold.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Inserter {
 public:
  Inserter(Device& device, WorkMesh<Device>& work) : device_(device), work_(work), threshold_(device), cutter_(device, work) {}

  /// Until there are so many triangles, or one fewer, or no sample is off, or no number is free.
  template <class Samples>
  void insert(const Samples& samples, std::uint64_t target) {
    work_.make_room(static_cast<std::size_t>(target - std::min(target, work_.triangles())) / 2 + 1);
    device_.each(work_.ids(), MakeAllStale{work_.mesh(), work_.wave()});
    for (std::uint32_t round = 0; round < 0xffe0u && work_.triangles() + 1 < target; ++round) {
      const std::size_t all = work_.ids();
      const Vertices stale = device_.list({all}, IsMarked{work_.wave(), kStale}, work_.room(list_, all));
      device_.each_star(stale, work_.crowd(), FindWorst<Samples>{work_.mesh(), work_.wave(), samples});
      const std::uint64_t missing = target - work_.triangles();
      const Count worst = threshold_.of_count(work_.wave(), all, static_cast<std::uint32_t>(std::max(missing / 2, kFewest)),
                                              work_.fresh_progress());
      if (!insert_round(missing, round, worst) && !insert_round(missing, ++round, {kCostClasses})) return;
    }
  }

 private:
  static constexpr std::uint64_t kFewest = 64;

  template <class T>
  using Array = typename Device::template Array<T>;

  bool insert_round(std::uint64_t missing, std::uint32_t round, Count most_class) {
    const std::size_t all = work_.ids();
    std::uint32_t *const list = work_.room(list_, all), *const winners = work_.room(winners_, all);
    const Insert insert{work_.mesh(), work_.wave(), winners, work_.room(free_, all)};
    const Vertices wanting = device_.list({all}, WantsInsert{insert, most_class}, list);
    device_.each_of(wanting, OfferClaim<Insert>{insert, round});
    device_.each_of(wanting, DecideClaim<Insert>{insert, round});
    const Vertices won = device_.list(wanting, IsWinner{insert.wave}, winners);
    device_.each_of(wanting, ForgetWinner{insert.wave});
    const std::size_t free = device_.select(all, IsGone{work_.mesh().vertex}, free_.data());
    const CutResult cut = cutter_.cut(winners, device_.value(won.count), IsIntoBorder{insert},
                                      {.budget = missing, .most = static_cast<std::uint32_t>(free), .evenly = true});
    device_.each(cut.taken, insert);
    work_.count(cut.taken, cut.sum);
    return cut.taken > 0;
  }

  Device& device_;
  WorkMesh<Device>& work_;
  Threshold<Device> threshold_;
  Cutter<Device> cutter_;
  Array<std::uint32_t> list_, winners_, free_;
};

}  // namespace cordillera::gpu::fit
