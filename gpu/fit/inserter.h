#pragma once
// Insertion of the worst samples, up to a count or until none exceeds an error.
#include <algorithm>

#include "gpu/fit/insert_steps.h"
#include "gpu/fit/threshold.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
class Inserter {
 public:
  Inserter(Device& device, WorkMesh<Device>& work) : device_(device), work_(work), threshold_(device) {}

  /// Until there are so many triangles, or one fewer, or no sample is farther off than least_error, or no number is free.
  template <class Samples>
  void insert(const Samples& samples, std::uint64_t target, float least_error) {
    work_.make_room(static_cast<std::size_t>(target - std::min(target, work_.triangles())) / 2 + 1);
    device_.each(work_.ids(), MakeAllStale{work_.mesh(), work_.wave()});
    for (std::uint32_t round = 0; round < 0xffe0u && work_.triangles() + 1 < target; ++round) {
      const std::size_t stale = device_.select(work_.ids(), IsMarked{work_.wave(), kStale}, work_.room(list_, work_.ids()));
      device_.each(stale, FindWorst<Samples>{work_.mesh(), work_.wave(), samples, list_.data(), least_error});
      if (!insert_round(target, round, kSome) && !insert_round(target, ++round, kCostClasses)) return;
    }
  }

 private:
  static constexpr std::uint32_t kSome = ~0u;
  static constexpr std::uint64_t kFewest = 64;

  template <class T>
  using Array = typename Device::template Array<T>;

  /// Among the worst that there is room for, or among all.
  bool insert_round(std::uint64_t target, std::uint32_t round, std::uint32_t most_class) {
    const std::size_t all = work_.ids();
    const std::uint64_t missing = target - work_.triangles();
    Insert insert{work_.mesh(), work_.wave(), work_.room(winners_, all), work_.room(free_, all)};
    const std::uint32_t most =
        most_class == kSome ? threshold_.of_count(insert.wave, all, std::max(missing / 2, kFewest)) : most_class;
    const std::size_t count = device_.select(all, WantsInsert{insert, most}, list_.data());
    if (count == 0) return false;
    device_.each(count, OfferClaim<Insert>{insert, round, list_.data()});
    device_.each(count, DecideClaim<Insert>{insert, round, list_.data()});
    const std::size_t won = device_.select(count, IsWinner{insert.wave, list_.data()}, winners_.data());
    device_.each(won, PickFrom{list_.data(), winners_.data()});
    device_.each(count, ForgetWinner{insert.wave, list_.data()});
    const std::size_t free = device_.select(all, IsGone{work_.mesh().vertex}, free_.data());
    const std::size_t taken = cut_short(insert, std::min(won, free), missing);
    device_.each(taken, insert);
    return taken > 0;
  }

  /// The worst first, as many as the count bears.
  std::size_t cut_short(const Insert& insert, std::size_t count, std::uint64_t missing) {
    device_.each(count, DescribeInsert{insert, winners_.data(), work_.room(keys_, count), work_.room(added_, count)});
    std::vector<std::uint64_t> keys(count);
    std::vector<std::uint32_t> added(count), vertex(count), order(count), taken;
    device_.copy_out(keys.data(), keys_.data(), count);
    device_.copy_out(added.data(), added_.data(), count);
    device_.copy_out(vertex.data(), winners_.data(), count);
    for (std::uint32_t i = 0; i < count; ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    std::uint64_t sum = 0;
    for (const std::uint32_t i : order) {
      if (sum + added[i] > missing || (added[i] == 1 && sum + 2 == missing)) continue;  // a single one could not be made up
      sum += added[i];
      taken.push_back(vertex[i]);
    }
    device_.copy_in(winners_.data(), taken.data(), taken.size());
    work_.count(static_cast<std::int64_t>(taken.size()), static_cast<std::int64_t>(sum));
    return taken.size();
  }

  Device& device_;
  WorkMesh<Device>& work_;
  Threshold<Device> threshold_;
  Array<std::uint32_t> list_, winners_, free_, added_;
  Array<std::uint64_t> keys_;
};

}  // namespace cordillera::gpu::fit
