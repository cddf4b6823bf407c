// True errors of tiles on CUDA: the steps of surface_error_steps.h and surface_error_rows.h.
#include "gpu/device/cuda_device.cuh"
#include "gpu/device/cuda_steps.cuh"
#include "tests/bench/batch_meter/surface_error_batch.inl"
#include "tests/bench/batch_meter/surface_error_cuda.h"

namespace cordillera::gpu {
namespace {

class CudaMeterDevice : public CudaSteps {
 public:
  CudaMeterDevice(int device, const cudaDeviceProp& properties)
      : CudaSteps(properties.multiProcessorCount), device_(device), name_(cuda_name(device, properties)) {}
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }
  std::string name() const { return name_; }

 private:
  int device_ = 0;
  std::string name_;
};

}  // namespace

proto::Result<std::unique_ptr<BatchMeter>> make_cuda_batch_meter(int device, ParallelFor parallel) {
  return with_cuda_device<BatchMeter>(device, [&](const cudaDeviceProp& properties) {
    return std::make_unique<BatchMeterOn<CudaMeterDevice>>(std::make_unique<CudaMeterDevice>(device, properties),
                                                           std::move(parallel));
  });
}

}  // namespace cordillera::gpu
