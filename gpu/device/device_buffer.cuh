#pragma once
// Device memory, and host memory that the device copies quickly: owned, move-only, uninitialised. Every CUDA call is checked; a
// failure is a DeviceLost, and the job goes on elsewhere.
#include <cuda_runtime.h>

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "gpu/device/device_lost.h"

namespace cordillera::gpu {

inline void check_cuda(cudaError_t error, const char* what) {
  if (error == cudaSuccess) return;
  cudaGetLastError();  // not to be taken for that of a launch, when this thread tries again
  throw DeviceLost(std::string(what) + ": " + cudaGetErrorString(error));
}
#define CORDILLERA_CUDA(call) ::cordillera::gpu::check_cuda((call), #call)

/// To give memory back waits for all that the device does, whoever asked for it: what a buffer has grown out of is put aside,
/// until the next one is given back or memory is short.
struct DeviceMemory {
  static void* take(std::size_t bytes) {
    void* data = nullptr;
    cudaError_t error = cudaMalloc(&data, bytes);
    if (error == cudaErrorMemoryAllocation) {
      cudaGetLastError();  // not to be taken for a launch's
      give_outgrown();     // another thread may just have done so
      error = cudaMalloc(&data, bytes);
    }
    check_cuda(error, "cudaMalloc");
    return data;
  }
  static void give(void* data) {
    cudaFree(data);
    give_outgrown();
  }
  static void outgrow(void* data) {
    const std::lock_guard lock(outgrown().mutex);
    outgrown().data.push_back(data);
  }

 private:
  struct Outgrown {
    std::mutex mutex;
    std::vector<void*> data;
  };
  static Outgrown& outgrown() {
    static Outgrown all;
    return all;
  }
  static void give_outgrown() {
    const std::lock_guard lock(outgrown().mutex);
    for (void* data : outgrown().data) cudaFree(data);
    outgrown().data.clear();
  }
};

struct PinnedMemory {
  static void* take(std::size_t bytes) {
    void* data = nullptr;
    CORDILLERA_CUDA(cudaMallocHost(&data, bytes));
    return data;
  }
  static void give(void* data) { cudaFreeHost(data); }
  static void outgrow(void* data) { give(data); }
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
  ~Buffer() {
    if (data_) Memory::give(data_);
  }

  T* data() const { return data_; }

  /// Room for count elements; what was there is lost when it must grow. What grows once has room for half as much again, where
  /// there is memory for that.
  void reserve(std::size_t count) {
    if (count <= capacity_) return;
    const std::size_t more = std::max(count, capacity_ + capacity_ / 2);
    if (data_) Memory::outgrow(data_);
    data_ = nullptr;
    capacity_ = 0;
    try {
      take(more);
    } catch (const DeviceLost&) {
      if (more == count) throw;
      take(count);
    }
  }

 private:
  void take(std::size_t count) {
    data_ = static_cast<T*>(Memory::take(count * sizeof(T)));
    capacity_ = count;
  }

  T* data_ = nullptr;
  std::size_t capacity_ = 0;
};

template <class T>
using DeviceBuffer = Buffer<T, DeviceMemory>;
template <class T>
using PinnedBuffer = Buffer<T, PinnedMemory>;

}  // namespace cordillera::gpu
