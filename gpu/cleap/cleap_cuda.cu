// The driver on CUDA: the one that the host runs too.
#include "gpu/cleap/driver.inl"
#include "gpu/fit/cuda_steps.cuh"

namespace cordillera::gpu::cleap {
namespace {

class CudaDevice : public fit::CudaFitSteps {
 public:
  CudaDevice(int device, const cudaDeviceProp& properties) : CudaFitSteps(properties.multiProcessorCount), device_(device) {
    name_ = "cuda:" + std::to_string(device) + " (" + properties.name + ")";
  }
  /// What a thread calls belongs to its current device.
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }
  std::string name() const { return name_; }

 private:
  int device_ = 0;
  std::string name_;
};

}  // namespace

proto::Result<std::unique_ptr<Engine>> make_cuda_engine(int device) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess || device >= count) {
    const std::string reason = error != cudaSuccess ? cudaGetErrorString(error) : "there are " + std::to_string(count);
    return proto::Problem{"device-unavailable", "CUDA device " + std::to_string(device) + " cannot be used: " + reason,
                          "auto, cpu", "device"};
  }
  try {
    cudaDeviceProp properties{};
    CORDILLERA_CUDA(cudaSetDevice(device));
    CORDILLERA_CUDA(cudaGetDeviceProperties(&properties, device));
    return std::unique_ptr<Engine>(std::make_unique<Driver<CudaDevice>>(std::make_unique<CudaDevice>(device, properties)));
  } catch (const DeviceLost& lost) {
    return proto::Problem{"device-unavailable", lost.what(), "auto, cpu", "device"};
  }
}

}  // namespace cordillera::gpu::cleap
