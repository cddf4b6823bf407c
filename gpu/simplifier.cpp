#include <algorithm>

#include "gpu/simplify.h"

namespace cordillera::gpu {

#ifndef CORDILLERA_HAS_CUDA
int cuda_devices() { return 0; }
bool has_cuda_driver() { return false; }
#endif

void one_after_the_other(std::size_t count, const std::function<void(std::size_t)>& work) {
  for (std::size_t i = 0; i < count; ++i) work(i);
}

std::optional<proto::Problem> check_strategy(const std::string& strategy, const std::string& device) {
  if (std::find(kStrategies.begin(), kStrategies.end(), strategy) == kStrategies.end()) {
    std::string names;
    for (const std::string name : kStrategies) names += (names.empty() ? "" : ", ") + name;
    return proto::Problem{"option-invalid", "strategy \"" + strategy + "\" is not known", names, "strategy"};
  }
  if (strategy != "sequential" || !device.starts_with("cuda")) return {};
  return proto::Problem{"options-conflict",
                        "strategy sequential collapses one edge after the other: there is nothing in it for a GPU",
                        "device auto or cpu, or strategy cleap", "device"};
}

}  // namespace cordillera::gpu
