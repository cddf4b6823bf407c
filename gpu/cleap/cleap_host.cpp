#include "gpu/cleap/driver.inl"
#include "gpu/fit/steps/host_steps.h"

namespace cordillera::gpu::cleap {

std::unique_ptr<Engine> make_host_engine(unsigned threads) {
  return std::make_unique<Driver<fit::HostSteps>>(std::make_unique<fit::HostSteps>(threads));
}

}  // namespace cordillera::gpu::cleap
