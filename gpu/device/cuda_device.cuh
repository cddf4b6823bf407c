#pragma once
// A CUDA device, asked for by its number.
#include <memory>
#include <string>

#include "gpu/device/device_buffer.cuh"
#include "gpu/device/device_lost.h"
#include "proto/result.h"

namespace cordillera::gpu {

/// "cuda:0 (NVIDIA …)"
inline std::string cuda_name(int device, const cudaDeviceProp& properties) {
  return "cuda:" + std::to_string(device) + " (" + properties.name + ")";
}

/// What make(properties) gives with the device as the thread's own; "device-unavailable" when it cannot be used.
template <class Made, class Make>
proto::Result<std::unique_ptr<Made>> with_cuda_device(int device, const Make& make) {
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
    return std::unique_ptr<Made>(make(properties));
  } catch (const DeviceLost& lost) { return proto::Problem{"device-unavailable", lost.what(), "auto, cpu", "device"}; }
}

}  // namespace cordillera::gpu
