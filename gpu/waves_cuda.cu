// Strategy `waves` on CUDA: a window is a block of threads, its arrays lie in shared memory (in global scratch on devices that have
// too little of it). The body is simplify_window(), the same source that the host runs.
#include <algorithm>

#include "gpu/device_buffer.cuh"
#include "gpu/waves.inl"

namespace cordillera::gpu {
namespace {

constexpr int kThreads = 256;

/// A block of threads.
struct BlockTeam {
  template <class F>
  __device__ void each(int n, const F& f) {
    for (int i = static_cast<int>(threadIdx.x); i < n; i += kThreads) f(i);
  }
  __device__ void barrier() { __syncthreads(); }

  /// Order within the lists does not matter: all decisions are by key.
  template <class Classify>
  __device__ void sort_out(int n, const Classify& classify, const WaveLists& lists) {
    if (threadIdx.x < 3) lists.counts[threadIdx.x] = 0;
    __syncthreads();
    std::uint16_t* const list[3] = {lists.touched, lists.candidates, lists.stale};
    const unsigned lane = threadIdx.x & 31u;
    for (int base = 0; base < n; base += kThreads) {
      const int u = base + static_cast<int>(threadIdx.x);
      const unsigned in = u < n ? classify(u) : 0u;
      for (int k = 0; k < 3; ++k) {
        const unsigned votes = __ballot_sync(~0u, (in >> k) & 1u);
        int at = 0;
        if (lane == 0 && votes) at = atomicAdd(&lists.counts[k], __popc(votes));
        at = __shfl_sync(~0u, at, 0);
        if ((in >> k) & 1u) list[k][at + __popc(votes & ((1u << lane) - 1u))] = static_cast<std::uint16_t>(u);
      }
    }
  }
};

__global__ void number_windows_kernel(MeshView mesh, const std::uint32_t* order, const WindowRange* windows) {
  const WindowRange range = windows[blockIdx.x];
  for (std::uint32_t i = threadIdx.x; i < range.count; i += blockDim.x) {
    const std::uint32_t v = order[range.first + i];
    mesh.window[v] = blockIdx.x;
    mesh.local[v] = static_cast<std::uint16_t>(i);
  }
}

__global__ void __launch_bounds__(kThreads) simplify_windows_kernel(MeshView mesh, const std::uint32_t* order, const WindowRange* windows,
                                                                    std::uint32_t count, const Rules* rules,
                                                                    const WaveSchedule* schedules, unsigned char* scratch) {
  extern __shared__ __align__(16) unsigned char shared[];
  unsigned char* storage = scratch ? scratch + blockIdx.x * window_bytes(kWindowVertices) : shared;
  BlockTeam team;
  for (std::uint32_t k = blockIdx.x; k < count; k += gridDim.x) {
    const WindowRange range = windows[k];
    simplify_window(team, mesh, order, range, k, rules[range.tile], schedules[range.tile], storage, kWindowVertices);
    __syncthreads();
  }
}

class CudaBackend {
 public:
  explicit CudaBackend(int device) : device_(device) {
    cudaDeviceProp properties{};
    CORDILLERA_CUDA(cudaSetDevice(device));
    CORDILLERA_CUDA(cudaGetDeviceProperties(&properties, device));
    name_ = "cuda:" + std::to_string(device) + " (" + properties.name + ")";
    shared_ = properties.sharedMemPerBlockOptin >= window_bytes(kWindowVertices);
    scratch_blocks_ = static_cast<unsigned>(8 * properties.multiProcessorCount);
    const int bytes = shared_ ? static_cast<int>(window_bytes(kWindowVertices)) : 0;
    CORDILLERA_CUDA(cudaFuncSetAttribute(simplify_windows_kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes));
  }

  void begin(BatchMesh& mesh) {
    CORDILLERA_CUDA(cudaSetDevice(device_));
    x_.upload(mesh.x);
    y_.upload(mesh.y);
    elevation_.upload(mesh.elevation);
    carried_.upload(mesh.carried);
    spent_.upload(mesh.spent);
    key_.upload(mesh.key);
    row_.upload(mesh.row);
    valence_.upload(mesh.valence);
    mark_.upload(mesh.mark);
    window_.reserve(mesh.vertices());
    local_.reserve(mesh.vertices());
    view_ = {x_.data(),   y_.data(),       elevation_.data(), carried_.data(), spent_.data(), key_.data(),
             row_.data(), valence_.data(), mark_.data(),      window_.data(),  local_.data()};
  }

  void run(BatchMesh& mesh, const WindowPass& pass) {
    const auto count = static_cast<std::uint32_t>(pass.cut.windows.size());
    order_.upload(pass.cut.order);
    windows_.upload(pass.cut.windows);
    rules_.upload(pass.rules);
    schedules_.upload(pass.schedules);
    number_windows_kernel<<<count, kThreads>>>(view_, order_.data(), windows_.data());
    CORDILLERA_CUDA(cudaGetLastError());
    const unsigned blocks = shared_ ? count : std::min(count, scratch_blocks_);
    if (!shared_) scratch_.reserve(blocks * window_bytes(kWindowVertices));
    simplify_windows_kernel<<<blocks, kThreads, shared_ ? window_bytes(kWindowVertices) : 0>>>(
        view_, order_.data(), windows_.data(), count, rules_.data(), schedules_.data(), shared_ ? nullptr : scratch_.data());
    CORDILLERA_CUDA(cudaGetLastError());
    mark_.download(mesh.mark);
  }

  void finish(BatchMesh& mesh) {
    row_.download(mesh.row);
    valence_.download(mesh.valence);
  }

  std::size_t vertices_at_once() const { return std::size_t{1} << 24; }
  std::string name() const { return name_; }

 private:
  int device_ = 0;
  std::string name_;
  bool shared_ = true;
  unsigned scratch_blocks_ = 0;
  MeshView view_;
  DeviceBuffer<std::int32_t> x_, y_;
  DeviceBuffer<float> elevation_, carried_, spent_;
  DeviceBuffer<std::uint32_t> key_, row_, window_, order_;
  DeviceBuffer<std::uint16_t> local_;
  DeviceBuffer<std::uint8_t> valence_, mark_;
  DeviceBuffer<WindowRange> windows_;
  DeviceBuffer<Rules> rules_;
  DeviceBuffer<WaveSchedule> schedules_;
  DeviceBuffer<unsigned char> scratch_;
};

}  // namespace

proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int device) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess || device >= count) {
    const std::string reason = error != cudaSuccess ? cudaGetErrorString(error) : "there are " + std::to_string(count);
    return proto::Problem{"device-unavailable", "CUDA device " + std::to_string(device) + " cannot be used: " + reason, "auto, cpu", "device"};
  }
  try {
    return std::unique_ptr<Simplifier>(std::make_unique<WaveSimplifier<CudaBackend>>(CudaBackend(device)));
  } catch (const DeviceLost& lost) {
    return proto::Problem{"device-unavailable", lost.what(), "auto, cpu", "device"};
  }
}

}  // namespace cordillera::gpu
