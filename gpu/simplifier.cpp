#include "gpu/device_choice.h"
#include "gpu/simplify.h"
#include "gpu/waves.h"

namespace cordillera::gpu {

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int, ParallelFor) { return built_without_cuda(); }
#endif

void one_after_the_other(std::size_t count, const std::function<void(std::size_t)>& work) {
  for (std::size_t i = 0; i < count; ++i) work(i);
}

proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device, ParallelFor parallel) {
  return on_device(
      device, [&] { return make_host_waves(parallel); }, [&](int number) { return make_cuda_waves(number, parallel); });
}

}  // namespace cordillera::gpu
