#include <algorithm>
#include <utility>

#include "gpu/simplify.h"

namespace cordillera::gpu {

#ifndef CORDILLERA_HAS_CUDA
int cuda_devices() { return 0; }
bool has_cuda_driver() { return false; }
#endif

namespace {
MakeSimplifier g_make_published = nullptr;
}

void offer_published(MakeSimplifier make) { g_make_published = make; }

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

proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device, ParallelFor parallel,
                                                           const std::string& strategy) {
  if (auto problem = check_strategy(strategy, device)) return *problem;
  if (strategy == kExact)
    return proto::Problem{"option-invalid", "strategy exact simplifies blocks, not tiles", "cleap, sequential", "strategy"};
  if (g_make_published != nullptr) return g_make_published(device, std::move(parallel), strategy);
  return proto::Problem{"option-invalid", "strategy " + strategy + " is not in this program", kExact, "strategy"};
}

}  // namespace cordillera::gpu
