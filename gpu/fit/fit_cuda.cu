// The fit on CUDA: the steps of cuda_steps.cuh, the driver that the host runs too.
#include <string>

#include "gpu/cuda_steps.cuh"
#include "gpu/fit/fitter.inl"

namespace cordillera::gpu::fit {
namespace {

/// The threads of a block.
struct BlockTeam {
  template <class F>
  __device__ void each(std::size_t n, const F& f) {
    for (std::size_t i = threadIdx.x; i < n; i += blockDim.x) f(i);
  }
  __device__ void barrier() { __syncthreads(); }
};

template <class F>
__global__ void __launch_bounds__(kStepThreads) each_block_kernel(F f) {
  BlockTeam team;
  f(team, std::size_t{blockIdx.x});
}

class CudaDevice : public CudaSteps {
 public:
  CudaDevice(int device, const cudaDeviceProp& properties) : CudaSteps(properties.multiProcessorCount), device_(device) {
    name_ = "cuda:" + std::to_string(device) + " (" + properties.name + ")";
  }
  /// What a thread calls belongs to its current device.
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }
  std::string name() const { return name_; }
  template <class F>
  void each_block(std::size_t blocks, const F& f) {
    if (blocks == 0) return;
    each_block_kernel<<<static_cast<unsigned>(blocks), kStepThreads, 0, stream_>>>(f);
    CORDILLERA_CUDA(cudaGetLastError());
  }

 private:
  int device_ = 0;
  std::string name_;
};

}  // namespace

proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int device) {
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
    return std::unique_ptr<FitEngine>(std::make_unique<Fitter<CudaDevice>>(std::make_unique<CudaDevice>(device, properties)));
  } catch (const DeviceLost& lost) {
    return proto::Problem{"device-unavailable", lost.what(), "auto, cpu", "device"};
  }
}

}  // namespace cordillera::gpu::fit
