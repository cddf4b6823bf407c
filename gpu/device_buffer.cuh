#pragma once
// Device memory: owned, move-only, uninitialised. Every CUDA call is checked; a failure is a DeviceLost, and the job goes on elsewhere.
#include <cuda_runtime.h>

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device_lost.h"

namespace cordillera::gpu {

inline void check_cuda(cudaError_t error, const char* what) {
  if (error != cudaSuccess) throw DeviceLost(std::string(what) + ": " + cudaGetErrorString(error));
}
#define CORDILLERA_CUDA(call) ::cordillera::gpu::check_cuda((call), #call)

template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  DeviceBuffer(DeviceBuffer&& other) noexcept : data_(std::exchange(other.data_, nullptr)), capacity_(std::exchange(other.capacity_, 0)) {}
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~DeviceBuffer() { cudaFree(data_); }

  T* data() const { return data_; }

  /// Room for count elements; what was there is lost when it must grow.
  void reserve(std::size_t count) {
    if (count <= capacity_) return;
    cudaFree(data_);
    data_ = nullptr;
    capacity_ = 0;
    CORDILLERA_CUDA(cudaMalloc(&data_, count * sizeof(T)));
    capacity_ = count;
  }
  void upload(std::span<const T> host) {
    reserve(host.size());
    CORDILLERA_CUDA(cudaMemcpy(data_, host.data(), host.size_bytes(), cudaMemcpyHostToDevice));
  }
  void download(std::vector<T>& host) const {
    CORDILLERA_CUDA(cudaMemcpy(host.data(), data_, host.size() * sizeof(T), cudaMemcpyDeviceToHost));
  }

 private:
  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

}  // namespace cordillera::gpu
