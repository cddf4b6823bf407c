// The engine on a CUDA device: a window is a block of threads, its arrays lie in shared memory (in global scratch on devices that
// have too little of it).
#include <algorithm>

#include "gpu/device/cuda_device.cuh"
#include "gpu/device/cuda_steps.cuh"
#include "gpu/device/warp_lanes.cuh"
#include "gpu/exact/engine.inl"
#include "gpu/exact/steps/block_team.cuh"

namespace cordillera::gpu::exact {
namespace {

constexpr int kThreads = 512, kWindowsAtOnce = 2;

/// A warp, as the engine's steps ask for it.
struct EngineLanes : WarpLanes<32, 8> {
  __device__ float coded_error(const Triangle& t, const Field& field, int sx, int sy) const {
    return coded_square_error(t, field, sx, sy, *this);
  }
  __device__ void add(ErrorSums& to, const ErrorSums& sums) const {
    atomicAdd(reinterpret_cast<Word*>(&to.squares), static_cast<Word>(sums.squares));
    atomicAdd(reinterpret_cast<Word*>(&to.samples), static_cast<Word>(sums.samples));
    atomicMax(reinterpret_cast<Word*>(&to.max_bits), static_cast<Word>(sums.max_bits));
  }
};

/// A place of so many columns a thread.
template <class F>
struct AtPlace {
  F f;
  std::uint32_t columns;
  __device__ void operator()(std::size_t i) const { f(static_cast<int>(i % columns), static_cast<int>(i / columns)); }
};

template <bool kShared>
__global__ void __launch_bounds__(kThreads, kWindowsAtOnce)
    windows_kernel(PassView pass, std::uint32_t count, unsigned char* scratch, std::size_t scratch_bytes) {
  extern __shared__ __align__(16) unsigned char shared[];
  BlockTeam team;
  for (std::uint32_t window = blockIdx.x; window < count; window += gridDim.x) {
    WindowPass<BlockTeam>(team, pass, window, kShared ? shared : scratch + blockIdx.x * scratch_bytes).run();
    __syncthreads();
  }
}

class CudaExecutor : public CudaSteps {
 public:
  CudaExecutor(int device, const cudaDeviceProp& properties, ParallelFor parallel)
      : CudaSteps(properties.multiProcessorCount), device_(device), parallel_(std::move(parallel)) {
    name_ = cuda_name(device, properties);
    shared_bytes_ = properties.sharedMemPerBlockOptin;
    scratch_blocks_ = static_cast<unsigned>(kWindowsAtOnce * properties.multiProcessorCount);
    const std::size_t most = std::min(shared_bytes_, window_bytes(kStackLength));
    CORDILLERA_CUDA(
        cudaFuncSetAttribute(windows_kernel<true>, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(most)));
  }

  static constexpr std::size_t kMostParts = 64;  ///< of a triangle that is measured

  void use(const std::atomic<bool>*) { CORDILLERA_CUDA(cudaSetDevice(device_)); }
  template <class T>
  void give_back(Array<T>&) {}  // a device that serves other calls keeps what it has
  void wait() { settle(); }
  std::string name() const { return name_; }
  template <class F>
  void parallel(std::size_t n, const F& work) {
    parallel_(n, work);
  }

  SampleRows rows(Array<std::int32_t>& room, const std::int32_t* from, std::int32_t columns, std::int32_t rows,
                  std::int64_t stride) {
    const auto width = static_cast<std::size_t>(columns), height = static_cast<std::size_t>(rows);
    room.reserve(width * height);
    CORDILLERA_CUDA(cudaMemcpy2DAsync(room.data(), width * 4, from, static_cast<std::size_t>(stride) * 4, width * 4, height,
                                      cudaMemcpyHostToDevice, stream_));
    return {room.data(), columns};
  }
  template <class T>
  const T* readable(Array<T>& room, const T* from, std::size_t n) {
    room.reserve(n);
    copy_in(room.data(), from, n);
    return room.data();
  }
  template <class F>
  void each_at(int columns, int rows, const F& f) {
    each(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), AtPlace<F>{f, static_cast<std::uint32_t>(columns)});
  }
  template <class F>
  void each_run(std::size_t n, const F& f) {
    each_with<EngineLanes>(n, f);
  }
  void windows(const PassView& pass, std::uint32_t count) {
    const std::size_t bytes = window_bytes(kStackLength);
    if (bytes <= shared_bytes_) {
      windows_kernel<true><<<count, kThreads, bytes, stream_>>>(pass, count, nullptr, 0);
    } else {
      const unsigned blocks = std::min(count, scratch_blocks_);
      scratch_.reserve(blocks * bytes);
      windows_kernel<false><<<blocks, kThreads, 0, stream_>>>(pass, count, scratch_.data(), bytes);
    }
    CORDILLERA_CUDA(cudaGetLastError());
  }

 private:
  int device_ = 0;
  ParallelFor parallel_;
  std::string name_;
  std::size_t shared_bytes_ = 0;
  unsigned scratch_blocks_ = 0;
  DeviceBuffer<unsigned char> scratch_;
};

}  // namespace

proto::Result<std::unique_ptr<BlockSimplifier>> make_cuda_engine(int device, ParallelFor parallel) {
  return with_cuda_device<BlockSimplifier>(device, [&](const cudaDeviceProp& properties) {
    return std::make_unique<Engine<CudaExecutor>>(std::make_unique<CudaExecutor>(device, properties, std::move(parallel)));
  });
}

}  // namespace cordillera::gpu::exact
