#pragma once
// The steps of the driver (see host_steps.h) on a CUDA device, on one stream.
#include <cooperative_groups.h>
#include <thrust/iterator/counting_iterator.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>
#include <cub/device/device_select.cuh>
#include <memory>
#include <span>

#include "gpu/device/device_buffer.cuh"

namespace cordillera::gpu {

inline constexpr unsigned kStepThreads = 256;

/// How many blocks a multiprocessor shall have room for: F::kBlocksAtOnce, if F knows, else the compiler may spend all registers
/// on one.
template <class F>
consteval int blocks_at_once() {
  if constexpr (requires { F::kBlocksAtOnce; })
    return F::kBlocksAtOnce;
  else
    return 1;
}

template <class F>
__global__ void __launch_bounds__(kStepThreads, blocks_at_once<F>()) each_kernel(std::size_t n, F f) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < n) f(i);
}

/// f(i, lanes) for i < n.
template <class Lanes, class F>
__global__ void __launch_bounds__(kStepThreads) lanes_kernel(std::size_t n, F f) {
  const std::size_t i = (std::size_t{blockIdx.x} * blockDim.x + threadIdx.x) / Lanes::kCount;
  if (i < n) f(i, Lanes{});
}

/// All threads of a cooperative launch.
struct GridTeam {
  template <class F>
  __device__ void each(std::size_t n, const F& f) {
    const std::size_t threads = std::size_t{gridDim.x} * blockDim.x;
    for (std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x; i < n; i += threads) f(i);
  }
  __device__ void barrier() { cooperative_groups::this_grid().sync(); }
};

template <class F>
__global__ void __launch_bounds__(kStepThreads) cooperate_kernel(F f) {
  GridTeam team;
  f(team);
}

class CudaSteps {
 public:
  static constexpr std::uint32_t kInStep = 32;  ///< threads that run in step

  template <class T>
  using Array = DeviceBuffer<T>;
  template <class T>
  using Staging = PinnedBuffer<T>;

  template <class T>
  void copy_in(T* to, const T* from, std::size_t n) {
    CORDILLERA_CUDA(cudaMemcpyAsync(to, from, n * sizeof(T), cudaMemcpyHostToDevice, stream_));
  }
  template <class T>
  void copy_out(T* to, const T* from, std::size_t n) {
    const std::size_t bytes = n * sizeof(T);
    const bool small = bytes <= kMailbox;  // into pageable memory a copy takes twice as long
    if (small) mailbox_.reserve(kMailbox);
    if (!small) settle();  // such a copy waits for what is before it without sleeping
    CORDILLERA_CUDA(
        cudaMemcpyAsync(small ? static_cast<void*>(mailbox_.data()) : to, from, bytes, cudaMemcpyDeviceToHost, stream_));
    settle();
    if (small) std::memcpy(to, mailbox_.data(), bytes);
  }
  /// Returns when the stream has done all that it was given. It looks a few times, for many steps are short; then the thread
  /// sleeps, since others have work for its core.
  void settle() {
    constexpr int kLooks = 20;
    for (int look = 0; look < kLooks; ++look) {
      const cudaError_t state = cudaStreamQuery(stream_);
      if (state == cudaSuccess) return;
      if (state != cudaErrorNotReady) check_cuda(state, "cudaStreamQuery");
      cudaGetLastError();  // not to be taken for a launch's
    }
    CORDILLERA_CUDA(cudaEventRecord(done_.get(), stream_));
    CORDILLERA_CUDA(cudaEventSynchronize(done_.get()));
  }
  template <class T>
  void zero(T* to, std::size_t n) {
    CORDILLERA_CUDA(cudaMemsetAsync(to, 0, n * sizeof(T), stream_));
  }
  template <class F>
  void each(std::size_t n, const F& f) {
    if (n == 0) return;
    each_kernel<<<static_cast<unsigned>((n + kStepThreads - 1) / kStepThreads), kStepThreads, 0, stream_>>>(n, f);
    CORDILLERA_CUDA(cudaGetLastError());
  }
  /// f(i, lanes), with Lanes::kCount threads for each i.
  template <class Lanes, class F>
  void each_with(std::size_t n, const F& f) {
    if (n == 0) return;
    const std::size_t threads = n * Lanes::kCount;
    lanes_kernel<Lanes><<<static_cast<unsigned>((threads + kStepThreads - 1) / kStepThreads), kStepThreads, 0, stream_>>>(n, f);
    CORDILLERA_CUDA(cudaGetLastError());
  }
  template <class F>
  void cooperate(std::size_t n, const F& f) {
    int resident = 0;
    CORDILLERA_CUDA(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, cooperate_kernel<F>, kStepThreads, 0));
    const auto most = static_cast<std::size_t>(resident) * static_cast<std::size_t>(multiprocessors_);
    const std::size_t blocks = std::clamp<std::size_t>((n + kStepThreads - 1) / kStepThreads, 1, most);
    F argument = f;
    void* arguments[] = {&argument};
    CORDILLERA_CUDA(cudaLaunchCooperativeKernel(reinterpret_cast<const void*>(cooperate_kernel<F>),
                                                dim3(static_cast<unsigned>(blocks)), dim3(kStepThreads), arguments, 0, stream_));
  }
  template <class Keep>
  std::size_t select(std::size_t n, const Keep& keep, std::uint32_t* to) {
    const thrust::counting_iterator<std::uint32_t> indices(0);
    selected_.reserve(1);
    with_scratch([&](void* scratch, std::size_t& bytes) {
      return cub::DeviceSelect::If(scratch, bytes, indices, to, selected_.data(), static_cast<std::int64_t>(n), keep, stream_);
    });
    std::uint32_t count = 0;
    copy_out(&count, selected_.data(), 1);
    return count;
  }
  void exclusive_sum(const std::uint32_t* from, std::uint32_t* to, std::size_t n) {
    with_scratch([&](void* scratch, std::size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(scratch, bytes, from, to, static_cast<std::int64_t>(n), stream_);
    });
  }
  void group(std::span<const std::uint32_t> values, const std::uint32_t* group_of, std::span<const std::uint32_t> first,
             std::uint32_t* to) {
    sorted_.reserve(values.size());
    const int bits = std::bit_width(first.size() - 1);
    with_scratch([&](void* scratch, std::size_t& bytes) {
      return cub::DeviceRadixSort::SortPairs(scratch, bytes, group_of, sorted_.data(), values.data(), to,
                                             static_cast<std::int64_t>(values.size()), 0, bits > 0 ? bits : 1, stream_);
    });
  }

 protected:
  /// CUB asks for scratch memory first, then works.
  template <class Call>
  void with_scratch(const Call& call) {
    std::size_t bytes = 0;
    CORDILLERA_CUDA(call(nullptr, bytes));
    scratch_.reserve(std::max<std::size_t>(bytes, 1));
    CORDILLERA_CUDA(call(scratch_.data(), bytes));
  }

  explicit CudaSteps(int multiprocessors) : multiprocessors_(multiprocessors) {
    cudaStream_t stream = nullptr;
    CORDILLERA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    owned_stream_.reset(stream);
    stream_ = stream;
    cudaEvent_t done = nullptr;
    CORDILLERA_CUDA(cudaEventCreateWithFlags(&done, cudaEventBlockingSync | cudaEventDisableTiming));
    done_.reset(done);
  }
  cudaStream_t stream_ = nullptr;

 private:
  struct DestroyStream {
    void operator()(cudaStream_t stream) const { cudaStreamDestroy(stream); }
  };
  struct DestroyEvent {
    void operator()(cudaEvent_t event) const { cudaEventDestroy(event); }
  };
  std::unique_ptr<CUstream_st, DestroyStream> owned_stream_;
  std::unique_ptr<CUevent_st, DestroyEvent> done_;
  static constexpr std::size_t kMailbox = 256;
  int multiprocessors_ = 0;
  PinnedBuffer<unsigned char> mailbox_;
  DeviceBuffer<unsigned char> scratch_;
  DeviceBuffer<std::uint32_t> selected_, sorted_;
};

}  // namespace cordillera::gpu
