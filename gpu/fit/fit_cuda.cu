// The fit on CUDA: the driver that the host runs too.
#include "gpu/fit/fitter.inl"
#include "gpu/fit/steps/cuda_steps.cuh"

namespace cordillera::gpu::fit {

proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int device) {
  return with_cuda_device<FitEngine>(device, [device](const cudaDeviceProp& properties) {
    return std::make_unique<Fitter<CudaFitDevice>>(std::make_unique<CudaFitDevice>(device, properties));
  });
}

}  // namespace cordillera::gpu::fit
