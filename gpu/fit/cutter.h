#pragma once
// Of changes that are more than a count bears, those that make it exact: in the order of their keys, as many as fit.
#include "gpu/fit/steps/lock_steps.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

/// A change counts two triangles, along the border one.
struct CutRules {
  std::uint64_t budget = 0;
  std::uint32_t most = ~std::uint32_t{0};  ///< changes
  bool evenly = false;                     ///< none by one that would leave one more to do: it might find no other
};

struct CutResult {
  std::uint32_t taken = 0, sum = 0;
};

struct KeyOfChange {
  FitMesh mesh;
  WaveView wave;
  const std::uint32_t* list;
  std::uint64_t* keys;
  CORDILLERA_HD void operator()(std::size_t i) const { keys[i] = bid_key(mesh, wave, list[i]); }
};

template <class IsSingle>
struct SizeOfChange {
  IsSingle is_single;
  const std::uint32_t* list;
  std::uint32_t* size;
  CORDILLERA_HD void operator()(std::size_t i) const { size[i] = is_single(list[i]) ? 1 : 2; }
};

/// Those taken come to stand first in the list.
struct FindCut {
  CutRules rules;
  std::uint32_t* list;
  const std::uint32_t* size;
  const std::uint32_t* before;  ///< the sum of sizes
  std::uint32_t count;
  CutResult* result;

  CORDILLERA_HD void operator()(std::size_t) const {
    std::uint32_t taken = surely_taken();
    std::uint64_t sum = taken == 0 ? 0 : std::uint64_t{before[taken - 1]} + size[taken - 1];
    for (std::uint32_t i = taken; i < count && sum < rules.budget; ++i) {
      if (sum + size[i] > rules.budget || (rules.evenly && size[i] == 1 && sum + 2 == rules.budget)) continue;
      sum += size[i];
      list[taken++] = list[i];
    }
    *result = {taken, static_cast<std::uint32_t>(sum)};
  }

 private:
  /// The first so many leave room for another two, whatever they are.
  CORDILLERA_HD std::uint32_t surely_taken() const {
    std::uint32_t low = 0, high = count;
    while (low < high) {
      const std::uint32_t middle = (low + high) / 2;
      if (std::uint64_t{before[middle]} + size[middle] + 2 <= rules.budget)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }
};

template <class Device>
class Cutter {
 public:
  Cutter(Device& device, WorkMesh<Device>& work) : device_(device), work_(work) {}

  /// Sorts the list.
  template <class IsSingle>
  CutResult cut(std::uint32_t* list, std::size_t count, const IsSingle& is_single, const CutRules& rules) {
    if (count == 0) return {};
    std::uint64_t* const keys = work_.room(keys_, count);
    std::uint32_t *const size = work_.room(size_, count), *const before = work_.room(before_, count);
    device_.each(count, KeyOfChange{work_.mesh(), work_.wave(), list, keys});
    device_.sort_by_key(keys, list, count);
    device_.each(count, SizeOfChange<IsSingle>{is_single, list, size});
    device_.exclusive_sum(size, before, count);
    const auto looked_at = static_cast<std::uint32_t>(std::min<std::size_t>(count, rules.most));
    device_.each(1, FindCut{rules, list, size, before, looked_at, work_.room(result_, 1)});
    CutResult result;
    device_.copy_out(&result, result_.data(), 1);
    return result;
  }

 private:
  Device& device_;
  WorkMesh<Device>& work_;
  typename Device::template Array<std::uint64_t> keys_;
  typename Device::template Array<std::uint32_t> size_, before_;
  typename Device::template Array<CutResult> result_;
};

}  // namespace cordillera::gpu::fit
