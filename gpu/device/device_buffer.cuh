#pragma once
// Device memory, and host memory that the device copies quickly: owned, move-only, uninitialised. Every CUDA call is checked; a
// failure is a DeviceLost, and the job goes on elsewhere.
#include <cuda_runtime.h>

#include <cstddef>
#include <string>
#include <utility>

#include "gpu/device/device_lost.h"

namespace cordillera::gpu {

inline void check_cuda(cudaError_t error, const char* what) {
  if (error != cudaSuccess) throw DeviceLost(std::string(what) + ": " + cudaGetErrorString(error));
}
#define CORDILLERA_CUDA(call) ::cordillera::gpu::check_cuda((call), #call)

struct DeviceMemory {
  static void* take(std::size_t bytes) {
    void* data = nullptr;
    CORDILLERA_CUDA(cudaMalloc(&data, bytes));
    return data;
  }
  static void give(void* data) { cudaFree(data); }
};

struct PinnedMemory {
  static void* take(std::size_t bytes) {
    void* data = nullptr;
    CORDILLERA_CUDA(cudaMallocHost(&data, bytes));
    return data;
  }
  static void give(void* data) { cudaFreeHost(data); }
};

template <class T, class Memory>
class Buffer {
 public:
  Buffer() = default;
  Buffer(Buffer&& other) noexcept : data_(std::exchange(other.data_, nullptr)), capacity_(std::exchange(other.capacity_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~Buffer() { Memory::give(data_); }

  T* data() const { return data_; }

  /// Room for count elements; what was there is lost when it must grow.
  void reserve(std::size_t count) {
    if (count <= capacity_) return;
    Memory::give(data_);
    data_ = nullptr;
    capacity_ = 0;
    data_ = static_cast<T*>(Memory::take(count * sizeof(T)));
    capacity_ = count;
  }

 private:
  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

template <class T>
using DeviceBuffer = Buffer<T, DeviceMemory>;
template <class T>
using PinnedBuffer = Buffer<T, PinnedMemory>;

}  // namespace cordillera::gpu
