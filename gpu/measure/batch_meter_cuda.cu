// Triangles measured on CUDA: a few lanes take each.
#include "gpu/device/cuda_device.cuh"
#include "gpu/device/cuda_steps.cuh"
#include "gpu/device/warp_lanes.cuh"
#include "gpu/measure/batch_meter_on.h"

namespace cordillera::gpu {
namespace {

class CudaMeterDevice : public CudaSteps {
 public:
  CudaMeterDevice(int device, const cudaDeviceProp& properties) : CudaSteps(properties.multiProcessorCount), device_(device) {}
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }
  /// Most triangles have few samples, in few rows.
  template <class Step>
  void measure(std::size_t n, const Step& step) {
    each_with<WarpLanes<8, 4>>(n, step);
  }

 private:
  int device_ = 0;
};

}  // namespace

proto::Result<std::unique_ptr<BatchMeter>> make_cuda_batch_meter(int device) {
  return with_cuda_device<BatchMeter>(device, [&](const cudaDeviceProp& properties) {
    return std::make_unique<BatchMeterOn<CudaMeterDevice>>(std::make_unique<CudaMeterDevice>(device, properties));
  });
}

}  // namespace cordillera::gpu
