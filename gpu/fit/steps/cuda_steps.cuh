#pragma once
// The steps of the driver (see fitter.h) on a CUDA device. Nothing waits but what says so: numbers that steps find stay there.
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "gpu/device/cuda_device.cuh"
#include "gpu/device/cuda_steps.cuh"
#include "gpu/fit/steps/lanes.h"
#include "gpu/fit/steps/shared_lanes.h"
#include "gpu/fit/steps/steps.h"

namespace cordillera::gpu::fit {

/// A warp's threads, kLanes of them a part.
template <std::uint32_t kLanes, std::uint32_t kHowMany>
struct WarpExchange {
  static constexpr std::uint32_t kCount = kLanes, kParts = kHowMany;
  __device__ std::uint32_t index() const { return threadIdx.x & (kLanes - 1); }
  __device__ std::uint32_t part() const { return threadIdx.x / kLanes & (kParts - 1); }
  template <class T>
  __device__ T from(const T& value, std::uint32_t lane) const {
    return exchanged<kLanes>(value, lane);
  }
  template <class T>
  __device__ T from_part(const T& value, std::uint32_t k) const {
    return exchanged<kLanes * kParts>(value, k * kLanes + index());
  }

 private:
  template <std::uint32_t kWidth, class T>
  __device__ static T exchanged(const T& value, std::uint32_t lane) {
    static_assert(sizeof(T) % 4 == 0);
    union Words {
      T value;
      unsigned word[sizeof(T) / 4];
      __device__ Words() {}
    } words;
    words.value = value;
    const unsigned first = threadIdx.x & 31u & ~(kWidth - 1);
    const unsigned mask = kWidth == 32 ? ~0u : ((1u << (kWidth & 31u)) - 1u) << first;
    for (unsigned& word : words.word) word = __shfl_sync(mask, word, static_cast<int>(lane), static_cast<int>(kWidth));
    return words.value;
  }
};

/// The team of a block: its threads.
struct BlockTeam {
  template <class F>
  __device__ void each(std::size_t n, const F& f) {
    for (std::size_t i = threadIdx.x; i < n; i += blockDim.x) f(i);
  }
  __device__ void barrier() { __syncthreads(); }
};

__device__ inline std::uint32_t first_item() { return blockIdx.x * blockDim.x + threadIdx.x; }

template <class F>
__global__ void __launch_bounds__(kStepThreads) each_item_kernel(Count count, F f) {
  const std::uint32_t n = count.value();
  for (std::uint32_t i = first_item(); i < n; i += gridDim.x * blockDim.x) f(i);
}
template <class F>
__global__ void __launch_bounds__(kStepThreads) each_of_kernel(Vertices vertices, F f) {
  const std::uint32_t n = vertices.count.value();
  for (std::uint32_t i = first_item(); i < n; i += gridDim.x * blockDim.x) f(vertices[i]);
}
template <class Exchange, class F>
__global__ void __launch_bounds__(kStepThreads) each_star_kernel(Vertices vertices, F f) {
  constexpr std::uint32_t kEach = Exchange::kCount * Exchange::kParts;
  const std::uint32_t n = vertices.count.value();
  const SharedLanes<Exchange> lanes{Exchange{}};
  for (std::uint32_t i = first_item() / kEach; i < n; i += gridDim.x * blockDim.x / kEach) f(lanes, vertices[i]);
}
/// Where there are many blocks, so many are to fit a multiprocessor: fewer registers, but none waits for a second turn.
constexpr unsigned kBlocksAtOnce = 8;
template <unsigned kAtOnce, class F>
__global__ void __launch_bounds__(kStepThreads, kAtOnce) each_block_kernel(F f) {
  BlockTeam team;
  f(team, std::size_t{blockIdx.x});
}

/// Where a split puts one part, and how many there are.
struct Part {
  std::uint32_t* to;
  std::uint32_t* count;
};
/// Room in a part for all threads of a block that are in it; this thread's place.
__device__ inline std::uint32_t take_place(bool in, std::uint32_t* count) {
  constexpr unsigned kWarps = kStepThreads / 32;
  __shared__ std::uint32_t before[kWarps + 1];
  const unsigned warp = threadIdx.x / 32, lane = threadIdx.x & 31u, votes = __ballot_sync(~0u, in);
  __syncthreads();
  if (lane == 0) before[warp] = __popc(votes);
  __syncthreads();
  if (threadIdx.x == 0) {
    std::uint32_t sum = 0;
    for (unsigned k = 0; k < kWarps; ++k) {
      const std::uint32_t some = before[k];
      before[k] = sum;
      sum += some;
    }
    before[kWarps] = sum > 0 ? atomicAdd(count, sum) : 0;
  }
  __syncthreads();
  return before[kWarps] + before[warp] + __popc(votes & ((1u << lane) - 1u));
}
template <bool kBoth, class Test>
__global__ void __launch_bounds__(kStepThreads) split_kernel(Vertices from, Test test, Part yes, Part no) {
  const std::uint32_t n = from.count.value();
  for (std::uint32_t begin = blockIdx.x * blockDim.x; begin < n; begin += gridDim.x * blockDim.x) {
    const std::uint32_t i = begin + threadIdx.x, v = i < n ? from[i] : 0;
    const bool in = i < n && test(v);
    const std::uint32_t place = take_place(in, yes.count);
    if (in) yes.to[place] = v;
    if (!kBoth) continue;
    const bool out = i < n && !in;
    const std::uint32_t other = take_place(out, no.count);
    if (out) no.to[other] = v;
  }
}

template <class ClassOf>
__global__ void __launch_bounds__(kStepThreads)
    histogram_kernel(std::uint32_t n, ClassOf class_of, std::uint32_t* bins, std::uint32_t classes) {
  extern __shared__ std::uint32_t own[];
  for (std::uint32_t k = threadIdx.x; k < classes; k += blockDim.x) own[k] = 0;
  __syncthreads();
  for (std::uint32_t i = first_item(); i < n; i += gridDim.x * blockDim.x) {
    const std::uint32_t k = class_of(i);
    if (k < classes) atomicAdd(own + k, 1u);
  }
  __syncthreads();
  for (std::uint32_t k = threadIdx.x; k < classes; k += blockDim.x) {
    if (own[k] > 0) atomicAdd(bins + k, own[k]);
  }
}

template <class T>
__global__ void post_kernel(T* to, const T* from) {
  *to = *from;
}

class CudaFitSteps : public CudaSteps {
 public:
  explicit CudaFitSteps(int multiprocessors)
      : CudaSteps(multiprocessors), most_blocks_(8 * static_cast<std::size_t>(multiprocessors)) {
    slots_.reserve(kSlots);
    posts_.reserve(kAhead * kPostBytes);
    for (Event& event : posted_) event = Event(cudaEventDisableTiming);
  }

  template <class F>
  void each(Count count, const F& f) {
    if (count.most > 0) each_item_kernel<<<blocks_for(count, 1), kStepThreads, 0, stream_>>>(count, f);
    CORDILLERA_CUDA(cudaGetLastError());
  }
  template <class F>
  void each_of(Vertices vertices, const F& f) {
    if (vertices.count.most > 0) each_of_kernel<<<blocks_for(vertices.count, 1), kStepThreads, 0, stream_>>>(vertices, f);
    CORDILLERA_CUDA(cudaGetLastError());
  }
  /// Where there are few samples to a vertex, a whole warp would find no work.
  template <class F>
  void each_star(Vertices vertices, std::size_t crowd, const F& f) {
    if (crowd < kCrowded)
      each_star_by<WarpExchange<kFewLanes, 1>>(vertices, f);
    else
      each_star_by<WarpExchange<kManyLanes, 1>>(vertices, f);
  }
  /// Likewise; then its lanes take an edge each, by groups.
  template <class F>
  void each_edge(Vertices vertices, std::size_t crowd, const F& f) {
    if (crowd < kCrowded)
      each_star_by<WarpExchange<kFewLanes, 32 / kFewLanes>>(vertices, f);
    else
      each_star_by<WarpExchange<kManyLanes, 1>>(vertices, f);
  }
  template <class F>
  void each_block(std::size_t blocks, const F& f) {
    const auto count = static_cast<unsigned>(blocks);
    if (count > 1)
      each_block_kernel<kBlocksAtOnce><<<count, kStepThreads, 0, stream_>>>(f);
    else if (count == 1)
      each_block_kernel<1><<<count, kStepThreads, 0, stream_>>>(f);
    CORDILLERA_CUDA(cudaGetLastError());
  }
  template <class F>
  void each_counting(std::size_t n, const F& f) {
    each(n, f);
  }

  std::size_t value(Count count) {
    std::uint32_t value = count.most;
    if (count.found) copy_out(&value, count.found, 1);
    return value;
  }
  template <class Keep>
  Vertices list(Vertices from, const Keep& keep, std::uint32_t* to) {
    return split<false>(from, keep, to, nullptr).yes;
  }
  template <bool kBoth = true, class Test>
  Split split(Vertices from, const Test& test, std::uint32_t* yes, std::uint32_t* no) {
    const Part in{yes, new_slot()}, out{no, kBoth ? new_slot() : nullptr};
    const std::uint32_t most = from.count.most;
    if (most > 0) split_kernel<kBoth><<<blocks_for(from.count, 1), kStepThreads, 0, stream_>>>(from, test, in, out);
    CORDILLERA_CUDA(cudaGetLastError());
    return {{{most, in.count}, yes}, {{most, out.count}, no}};
  }

  template <class ClassOf>
  void histogram(std::size_t n, const ClassOf& class_of, std::uint32_t* bins, std::size_t classes) {
    constexpr std::size_t kEnough = 8 * kStepThreads;  // items a block, lest emptying it costs more than filling it
    const std::size_t blocks = std::clamp<std::size_t>(n / kEnough, 1, most_blocks_ / 2);
    histogram_kernel<<<static_cast<unsigned>(blocks), kStepThreads, classes * sizeof(std::uint32_t), stream_>>>(
        static_cast<std::uint32_t>(n), class_of, bins, static_cast<std::uint32_t>(classes));
    CORDILLERA_CUDA(cudaGetLastError());
  }

  void sort_by_key(std::uint64_t* keys, std::uint32_t* values, std::size_t n) {
    sorted_keys_.reserve(n);
    sorted_values_.reserve(n);
    with_scratch([&](void* scratch, std::size_t& bytes) {
      return cub::DeviceRadixSort::SortPairs(scratch, bytes, keys, sorted_keys_.data(), values, sorted_values_.data(),
                                             static_cast<std::int64_t>(n), 0, 48, stream_);
    });
    CORDILLERA_CUDA(cudaMemcpyAsync(keys, sorted_keys_.data(), n * sizeof(*keys), cudaMemcpyDeviceToDevice, stream_));
    CORDILLERA_CUDA(cudaMemcpyAsync(values, sorted_values_.data(), n * sizeof(*values), cudaMemcpyDeviceToDevice, stream_));
  }

  /// Lets the host run ahead of the device by some calls.
  template <class T>
  class Watch {
   public:
    explicit Watch(CudaFitSteps& steps) : steps_(steps) {}
    std::optional<T> look(const T* at) {
      static_assert(sizeof(T) <= kPostBytes);
      post_kernel<<<1, 1, 0, steps_.stream_>>>(place(looks_), at);
      CORDILLERA_CUDA(cudaGetLastError());
      CORDILLERA_CUDA(cudaEventRecord(steps_.posted_[looks_ % kAhead].get(), steps_.stream_));
      if (++looks_ < kAhead) return {};
      CORDILLERA_CUDA(cudaEventSynchronize(steps_.posted_[looks_ % kAhead].get()));
      return *place(looks_);
    }

   private:
    T* place(std::size_t look) const { return reinterpret_cast<T*>(steps_.posts_.data() + look % kAhead * kPostBytes); }

    CudaFitSteps& steps_;
    std::size_t looks_ = 0;
  };
  template <class T>
  Watch<T> watch() {
    return Watch<T>(*this);
  }

  /// A moment on the device's clock.
  std::size_t stamp() {
    if (stamps_ == stamp_.size()) stamp_.emplace_back();
    CORDILLERA_CUDA(cudaEventRecord(stamp_[stamps_].get(), stream_));
    return stamps_++;
  }
  /// Waits for the later one.
  double seconds_between(std::size_t from, std::size_t to) {
    float milliseconds = 0;
    CORDILLERA_CUDA(cudaEventSynchronize(stamp_[to].get()));
    CORDILLERA_CUDA(cudaEventElapsedTime(&milliseconds, stamp_[from].get(), stamp_[to].get()));
    return 1e-3 * static_cast<double>(milliseconds);
  }
  void forget_stamps() { stamps_ = 0; }

 private:
  static constexpr std::size_t kSlots = 4096, kAhead = 3, kPostBytes = 64, kCrowded = 6;
  static constexpr std::uint32_t kFewLanes = 8, kManyLanes = 32;

  class Event {
   public:
    explicit Event(unsigned flags = cudaEventDefault) { CORDILLERA_CUDA(cudaEventCreateWithFlags(&event_, flags)); }
    Event(Event&& other) noexcept : event_(std::exchange(other.event_, nullptr)) {}
    Event& operator=(Event&& other) noexcept {
      std::swap(event_, other.event_);
      return *this;
    }
    ~Event() {
      if (event_) cudaEventDestroy(event_);
    }
    cudaEvent_t get() const { return event_; }

   private:
    cudaEvent_t event_ = nullptr;
  };

  template <class Exchange, class F>
  void each_star_by(Vertices vertices, const F& f) {
    if (vertices.count.most == 0) return;
    const unsigned blocks = blocks_for(vertices.count, Exchange::kCount * Exchange::kParts);
    each_star_kernel<Exchange><<<blocks, kStepThreads, 0, stream_>>>(vertices, f);
    CORDILLERA_CUDA(cudaGetLastError());
  }
  unsigned blocks_for(Count count, std::size_t lanes) const {
    const std::size_t blocks = (count.most * lanes + kStepThreads - 1) / kStepThreads;
    return static_cast<unsigned>(count.found ? std::min(blocks, most_blocks_) : blocks);
  }
  /// A zeroed place for a number. It lasts for many more: a half of them is zeroed as the first of it is given out.
  std::uint32_t* new_slot() {
    if (slot_ % (kSlots / 2) == 0) zero(slots_.data() + slot_, kSlots / 2);
    std::uint32_t* const slot = slots_.data() + slot_;
    slot_ = (slot_ + 1) % kSlots;
    return slot;
  }

  std::size_t most_blocks_ = 0, slot_ = 0, stamps_ = 0;
  DeviceBuffer<std::uint32_t> slots_, sorted_values_;
  DeviceBuffer<std::uint64_t> sorted_keys_;
  PinnedBuffer<unsigned char> posts_;
  std::array<Event, kAhead> posted_;
  std::vector<Event> stamp_;
};

/// The steps on one device, as drivers ask for them.
class CudaFitDevice : public CudaFitSteps {
 public:
  CudaFitDevice(int device, const cudaDeviceProp& properties)
      : CudaFitSteps(properties.multiProcessorCount), device_(device), name_(cuda_name(device, properties)) {}
  /// What a thread calls belongs to its current device.
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }
  std::string name() const { return name_; }

 private:
  int device_ = 0;
  std::string name_;
};

}  // namespace cordillera::gpu::fit
