// Strategy `waves` on CUDA: a window is a block of threads, its arrays lie in shared memory (in global scratch on devices that have
// too little of it). The body is simplify_window(), the same source that the host runs.
#include <algorithm>

#include "gpu/cuda_steps.cuh"
#include "gpu/waves.inl"

namespace cordillera::gpu {
namespace {

// Measured on an H200: more threads a block wait longer for each other, fewer leave the multiprocessor idle; four windows of rows as wide
// as kInnerValence are what its shared memory holds.
constexpr int kThreads = 256, kWindowsAtOnce = 4;

/// A block of threads.
struct BlockTeam {
  template <class F>
  __device__ void each(int n, const F& f) {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += kThreads) f(i);
  }
  __device__ void barrier() { __syncthreads(); }

  /// Order within the lists does not matter: all decisions are by key. A warp takes its places in all lists at once.
  template <class Classify>
  __device__ void sort_out(int n, const Classify& classify, WaveLists& lists) {
    constexpr int kRounds = (kWindowVertices + kThreads - 1) / kThreads;
    std::uint64_t* const last = lists.counts;
    lists.counts = reinterpret_cast<std::uint64_t*>(reinterpret_cast<std::uintptr_t>(last) ^ sizeof(std::uint64_t));
    const int lane = static_cast<int>(threadIdx.x & 31u);
    unsigned votes[kRounds][3];
    int sums[3] = {};
#pragma unroll
    for (int r = 0; r < kRounds; ++r) {
      const int u = r * kThreads + static_cast<int>(threadIdx.x);
      const unsigned in = u < n ? classify(u) : 0u;
      for (int k = 0; k < 3; ++k) sums[k] += __popc(votes[r][k] = __ballot_sync(~0u, in >> k & 1u));
    }
    Places places = take_places(lists, sums, lane);
#pragma unroll
    for (int r = 0; r < kRounds; ++r) {
      const int u = r * kThreads + static_cast<int>(threadIdx.x);
      for (int k = 0; k < 3; ++k) {
        if (votes[r][k] >> lane & 1u) lists.set(static_cast<WaveList>(k), places.at[k] + __popc(votes[r][k] & ((1u << lane) - 1u)), u);
        places.at[k] += __popc(votes[r][k]);
      }
    }
    if (threadIdx.x == 0) *last = 0;
  }

 private:
  struct Places {
    int at[3];
  };
  /// Room for a warp's vertices in every list.
  __device__ static Places take_places(const WaveLists& lists, const int (&sums)[3], int lane) {
    using Word = unsigned long long;
    const Word sum = static_cast<Word>(sums[0]) | static_cast<Word>(sums[1]) << 16 | static_cast<Word>(sums[2]) << 32;
    Word at = 0;
    if (lane == 0 && sum) at = atomicAdd(reinterpret_cast<Word*>(lists.counts), sum);
    at = __shfl_sync(~0u, at, 0);
    return {{static_cast<int>(at & 0xffffu), static_cast<int>(at >> 16 & 0xffffu), static_cast<int>(at >> 32)}};
  }
};

/// kShared: the windows lie in shared memory, and the compiler knows it; else in scratch.
template <bool kShared>
__global__ void __launch_bounds__(kThreads, kWindowsAtOnce)
    simplify_windows_kernel(MeshView mesh, WindowCut cut, const BatchTile* tiles, unsigned char* scratch, std::size_t scratch_bytes) {
  extern __shared__ __align__(16) unsigned char shared[];
  BlockTeam team;
  for (std::uint32_t k = blockIdx.x; k < cut.count; k += gridDim.x) {
    if (!cut.nodes[k].is_window()) continue;
    const BatchTile& tile = tiles[cut.nodes[k].tile];
    unsigned char* const storage = kShared ? shared : scratch + blockIdx.x * scratch_bytes;
    simplify_window(team, mesh, cut.window(k), tile.rules, tile.schedule, storage, kWindowVertices);
    __syncthreads();
  }
}

class CudaDevice : public CudaSteps {
 public:
  CudaDevice(int device, const cudaDeviceProp& properties) : CudaSteps(properties.multiProcessorCount), device_(device) {
    name_ = "cuda:" + std::to_string(device) + " (" + properties.name + ")";
    shared_bytes_ = properties.sharedMemPerBlockOptin;
    scratch_blocks_ = static_cast<unsigned>(8 * properties.multiProcessorCount);
    const std::size_t widest = std::min(shared_bytes_, window_bytes(kWindowVertices, kRowWidth));
    CORDILLERA_CUDA(cudaFuncSetAttribute(simplify_windows_kernel<true>, cudaFuncAttributeMaxDynamicSharedMemorySize, static_cast<int>(widest)));
  }

  /// What a thread calls belongs to its current device.
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }

  void simplify(const MeshView& mesh, const WindowCut& cut, const TileFinder& tiles, std::uint32_t row_width) {
    const std::size_t bytes = window_bytes(kWindowVertices, row_width);
    const auto count = static_cast<unsigned>(cut.count);
    if (bytes <= shared_bytes_) {
      simplify_windows_kernel<true><<<count, kThreads, bytes, stream_>>>(mesh, cut, tiles.tiles, nullptr, 0);
    } else {
      const unsigned blocks = std::min(count, scratch_blocks_);
      scratch_.reserve(blocks * bytes);
      simplify_windows_kernel<false><<<blocks, kThreads, 0, stream_>>>(mesh, cut, tiles.tiles, scratch_.data(), bytes);
    }
    CORDILLERA_CUDA(cudaGetLastError());
  }

  std::size_t vertices_at_once() const { return std::size_t{1} << 24; }
  std::string name() const { return name_; }

 private:
  int device_ = 0;
  std::string name_;
  std::size_t shared_bytes_ = 0;
  unsigned scratch_blocks_ = 0;
  DeviceBuffer<unsigned char> scratch_;
};

}  // namespace

proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int device, ParallelFor parallel) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess || device >= count) {
    const std::string reason = error != cudaSuccess ? cudaGetErrorString(error) : "there are " + std::to_string(count);
    return proto::Problem{"device-unavailable", "CUDA device " + std::to_string(device) + " cannot be used: " + reason, "auto, cpu", "device"};
  }
  try {
    cudaDeviceProp properties{};
    CORDILLERA_CUDA(cudaSetDevice(device));
    CORDILLERA_CUDA(cudaGetDeviceProperties(&properties, device));
    return std::unique_ptr<Simplifier>(
        std::make_unique<WaveSimplifier<CudaDevice>>(std::make_unique<CudaDevice>(device, properties), std::move(parallel)));
  } catch (const DeviceLost& lost) {
    return proto::Problem{"device-unavailable", lost.what(), "auto, cpu", "device"};
  }
}

}  // namespace cordillera::gpu
