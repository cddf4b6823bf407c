// Strategy `waves` on CUDA: a window is a block of threads, its arrays lie in shared memory (in global scratch on devices that
// have too little of it). The body is simplify_window(), the same source that the host runs.
#include <algorithm>

#include "gpu/device/cuda_device.cuh"
#include "gpu/device/cuda_steps.cuh"
#include "gpu/waves/collapse/waves.inl"

namespace cordillera::gpu {
namespace {

/// What a block is made for. Measured on an H200: where windows abound, more threads a window wait longer for each other and
/// fewer leave the multiprocessor idle; its shared memory holds four windows of rows as wide as kInnerValence, or eight of half
/// the size. Where there are few, the slowest window is what counts.
struct FullWindows {
  static constexpr int kThreads = 256, kAtOnce = 4, kCapacity = kWindowVertices;
};
struct HalfWindows {
  static constexpr int kThreads = 128, kAtOnce = 8, kCapacity = 536;
};
struct FewWindows {
  static constexpr int kThreads = 512, kAtOnce = 2, kCapacity = kWindowVertices;
};
static_assert(HalfWindows::kCapacity % 4 == 0);

/// A block of threads.
template <int kThreads>
struct WindowTeam {
  template <class F>
  __device__ void each(int n, const F& f) {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += kThreads) f(i);
  }
  __device__ void barrier() { __syncthreads(); }

  /// Order within the lists does not matter: all decisions are by key. A thread looks at four vertices, a warp takes its places
  /// in all lists at once.
  __device__ void sort_out(int n, const Classify& classify, WaveLists& lists) {
    std::uint64_t* const last = lists.counts;
    lists.counts = reinterpret_cast<std::uint64_t*>(reinterpret_cast<std::uintptr_t>(last) ^ sizeof(std::uint64_t));
    const int lane = static_cast<int>(threadIdx.x & 31u);
    for (int warp_first = 4 * (static_cast<int>(threadIdx.x) - lane); warp_first < n; warp_first += 4 * kThreads) {
      const int first = warp_first + 4 * lane;
      unsigned in[kWaveLists] = {};  // four bits each
      if (first < n) look_at_four(classify, first, n, in);
      // The counts of a warp are at most 128.
      const unsigned own = __popc(in[0]) | __popc(in[1]) << 8 | __popc(in[2]) << 16;
      unsigned sum = own;
      for (int d = 1; d < 32; d *= 2) {
        const unsigned before = __shfl_up_sync(~0u, sum, d);
        if (lane >= d) sum += before;
      }
      const Places places = take_places(lists, sum, own);
      for (int k = 0; k < kWaveLists; ++k) {
        for (int e = 0, at = places.at[k]; e < 4; ++e) {
          if (in[k] >> e & 1u) lists.set(static_cast<WaveList>(k), at++, first + e);
        }
      }
    }
    if (threadIdx.x == 0) *last = 0;
  }

 private:
  struct Places {
    int at[kWaveLists];
  };
  __device__ static void look_at_four(const Classify& classify, int first, int n, unsigned (&in)[kWaveLists]) {
    const std::uint32_t states = *reinterpret_cast<const std::uint32_t*>(classify.w.state + first);
    const uint4 keys = *reinterpret_cast<const uint4*>(classify.w.key + first);
    const std::uint32_t key[4] = {keys.x, keys.y, keys.z, keys.w};
#pragma unroll
    for (int e = 0; e < 4; ++e) {
      const unsigned lists = first + e < n ? classify.lists(static_cast<std::uint8_t>(states >> 8 * e), key[e]) : 0u;
      for (int k = 0; k < kWaveLists; ++k) in[k] |= (lists >> k & 1u) << e;
    }
  }
  /// Room for a warp's vertices in every list. sum: of this lane and those before it, own: of this lane, 8 bits a list.
  __device__ static Places take_places(const WaveLists& lists, unsigned sum, unsigned own) {
    using Word = unsigned long long;
    const Word widened =
        static_cast<Word>(sum & 0xffu) | static_cast<Word>(sum >> 8 & 0xffu) << 16 | static_cast<Word>(sum >> 16) << 32;
    Word at = 0;
    if ((threadIdx.x & 31u) == 31 && sum) at = atomicAdd(reinterpret_cast<Word*>(lists.counts), widened);
    at = __shfl_sync(~0u, at, 31);
    const unsigned before = sum - own;
    return {{static_cast<int>((at & 0xffffu) + (before & 0xffu)), static_cast<int>((at >> 16 & 0xffffu) + (before >> 8 & 0xffu)),
             static_cast<int>((at >> 32) + (before >> 16))}};
  }
};

/// Windows of at least `fewest` vertices that fit. kShared: they lie in shared memory, and the compiler knows it; else in
/// scratch.
template <class Windows, bool kShared>
__global__ void __launch_bounds__(Windows::kThreads, Windows::kAtOnce)
    simplify_windows_kernel(MeshView mesh, WindowCut cut, const BatchTile* tiles, std::uint32_t fewest, unsigned char* scratch,
                            std::size_t scratch_bytes) {
  extern __shared__ __align__(16) unsigned char shared[];
  WindowTeam<Windows::kThreads> team;
  for (std::uint32_t k = blockIdx.x; k < cut.count; k += gridDim.x) {
    const QuadNode& node = cut.nodes[k];
    if (!node.is_window() || node.count < fewest || node.count > Windows::kCapacity) continue;
    const BatchTile& tile = tiles[node.tile];
    unsigned char* const storage = kShared ? shared : scratch + blockIdx.x * scratch_bytes;
    simplify_window(team, mesh, cut.window(k), tile.rules, storage, Windows::kCapacity);
    __syncthreads();
  }
}

/// A second stream, and the events that part it from the first and join them again.
struct SideStream {
  SideStream() {
    CORDILLERA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
    CORDILLERA_CUDA(cudaEventCreateWithFlags(&begin, cudaEventDisableTiming));
    CORDILLERA_CUDA(cudaEventCreateWithFlags(&end, cudaEventDisableTiming));
  }
  SideStream(const SideStream&) = delete;
  SideStream& operator=(const SideStream&) = delete;
  ~SideStream() {
    cudaEventDestroy(begin);
    cudaEventDestroy(end);
    cudaStreamDestroy(stream);
  }
  cudaStream_t stream = nullptr;
  cudaEvent_t begin = nullptr, end = nullptr;
};

class CudaDevice : public CudaSteps {
 public:
  CudaDevice(int device, const cudaDeviceProp& properties) : CudaSteps(properties.multiProcessorCount), device_(device) {
    name_ = cuda_name(device, properties);
    shared_bytes_ = properties.sharedMemPerBlockOptin;
    processors_ = static_cast<unsigned>(properties.multiProcessorCount);
    scratch_blocks_ = 8 * processors_;
    allow_shared<FullWindows>();
    allow_shared<HalfWindows>();
    allow_shared<FewWindows>();
  }

  /// What a thread calls belongs to its current device.
  void use() { CORDILLERA_CUDA(cudaSetDevice(device_)); }

  void simplify(const MeshView& mesh, const WindowCut& cut, const TileFinder& tiles, std::uint32_t row_width) {
    if (cut.count <= kFewPerMultiprocessor * processors_) {
      if (cut.count <= processors_)
        simplify_those<FewWindows>(mesh, cut, tiles, {row_width, 1, stream_}, full_scratch_);
      else
        simplify_those<FullWindows>(mesh, cut, tiles, {row_width, 1, stream_}, full_scratch_);
      return;
    }
    // Side by side: the last windows of the one kind run beside the first of the other.
    CORDILLERA_CUDA(cudaEventRecord(side_.begin, stream_));
    CORDILLERA_CUDA(cudaStreamWaitEvent(side_.stream, side_.begin, 0));
    simplify_those<FullWindows>(mesh, cut, tiles, {row_width, HalfWindows::kCapacity + 1, stream_}, full_scratch_);
    simplify_those<HalfWindows>(mesh, cut, tiles, {row_width, 1, side_.stream}, half_scratch_);
    CORDILLERA_CUDA(cudaEventRecord(side_.end, side_.stream));
    CORDILLERA_CUDA(cudaStreamWaitEvent(stream_, side_.end, 0));
  }

  std::size_t vertices_at_once() const { return std::size_t{1} << 24; }
  std::string name() const { return name_; }

 private:
  template <class Windows>
  void allow_shared() {
    const std::size_t widest = std::min(shared_bytes_, window_bytes(Windows::kCapacity, kRowWidth));
    CORDILLERA_CUDA(cudaFuncSetAttribute(simplify_windows_kernel<Windows, true>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                                         static_cast<int>(widest)));
  }
  struct Launch {
    std::uint32_t row_width, fewest;
    cudaStream_t stream;
  };
  template <class Windows>
  void simplify_those(const MeshView& mesh, const WindowCut& cut, const TileFinder& tiles, const Launch& how,
                      DeviceBuffer<unsigned char>& scratch) {
    const std::size_t bytes = window_bytes(Windows::kCapacity, how.row_width);
    const auto count = static_cast<unsigned>(cut.count);
    if (bytes <= shared_bytes_) {
      simplify_windows_kernel<Windows, true>
          <<<count, Windows::kThreads, bytes, how.stream>>>(mesh, cut, tiles.tiles, how.fewest, nullptr, 0);
    } else {
      const unsigned blocks = std::min(count, scratch_blocks_);
      scratch.reserve(blocks * bytes);
      simplify_windows_kernel<Windows, false>
          <<<blocks, Windows::kThreads, 0, how.stream>>>(mesh, cut, tiles.tiles, how.fewest, scratch.data(), bytes);
    }
    CORDILLERA_CUDA(cudaGetLastError());
  }

  static constexpr unsigned kFewPerMultiprocessor = 8;
  int device_ = 0;
  std::string name_;
  std::size_t shared_bytes_ = 0;
  unsigned scratch_blocks_ = 0, processors_ = 0;
  SideStream side_;
  DeviceBuffer<unsigned char> full_scratch_, half_scratch_;
};

}  // namespace

proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int device, ParallelFor parallel) {
  return with_cuda_device<Simplifier>(device, [&](const cudaDeviceProp& properties) {
    return std::make_unique<WaveSimplifier<CudaDevice>>(std::make_unique<CudaDevice>(device, properties), std::move(parallel));
  });
}

}  // namespace cordillera::gpu
