// The driver on CUDA: the one that the host runs too.
#include "gpu/cleap/driver.inl"
#include "gpu/fit/steps/cuda_steps.cuh"

namespace cordillera::gpu::cleap {

proto::Result<std::unique_ptr<Engine>> make_cuda_engine(int device) {
  return with_cuda_device<Engine>(device, [device](const cudaDeviceProp& properties) {
    return std::make_unique<Driver<fit::CudaFitDevice>>(std::make_unique<fit::CudaFitDevice>(device, properties));
  });
}

}  // namespace cordillera::gpu::cleap
