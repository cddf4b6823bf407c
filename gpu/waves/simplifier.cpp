#include "gpu/device/device_choice.h"
#include "gpu/simplify.h"
#include "gpu/waves/collapse/waves.h"

namespace cordillera::gpu {

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int, ParallelFor) { return built_without_cuda(); }
#endif

namespace {
MakeSimplifier g_make_published = nullptr;
}

void offer_published(MakeSimplifier make) { g_make_published = make; }

proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device, ParallelFor parallel,
                                                           const std::string& strategy) {
  if (auto problem = check_strategy(strategy, device)) return *problem;
  if (strategy == kExact)
    return proto::Problem{"option-invalid", "strategy exact simplifies blocks, not tiles", "waves, cleap, sequential",
                          "strategy"};
  if (strategy != kStrategies.front()) {
    if (g_make_published != nullptr) return g_make_published(device, std::move(parallel), strategy);
    return proto::Problem{"option-invalid", "strategy " + strategy + " is not in this program", "waves", "strategy"};
  }
  return on_device(
      device, [&] { return make_host_waves(parallel); }, [&](int number) { return make_cuda_waves(number, parallel); });
}

}  // namespace cordillera::gpu
