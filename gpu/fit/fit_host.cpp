#include "gpu/fit/fitter.inl"
#include "gpu/fit/steps/host_steps.h"

namespace cordillera::gpu::fit {

std::unique_ptr<FitEngine> make_host_fit(unsigned threads) {
  return std::make_unique<Fitter<HostSteps>>(std::make_unique<HostSteps>(threads));
}

}  // namespace cordillera::gpu::fit
