#pragma once
// Lanes of a warp that work on one thing together; see lanes.h.
#include <cstdint>

namespace cordillera::gpu {

/// kLanes neighbours of a warp, a power of two, in rows of kColumns.
template <int kLanes, int kColumns>
struct WarpLanes {
  static constexpr int kCount = kLanes;
  using Word = unsigned long long;
  __device__ int index() const { return static_cast<int>(threadIdx.x & (kLanes - 1)); }
  __device__ int row() const { return index() / kColumns; }
  __device__ int rows() const { return kLanes / kColumns; }
  __device__ int column() const { return index() % kColumns; }
  __device__ int columns() const { return kColumns; }
  __device__ std::uint64_t sum(std::uint64_t value) const {
    for (int o = kLanes / 2; o; o /= 2) value += __shfl_xor_sync(mask(), static_cast<Word>(value), o);
    return value;
  }
  __device__ std::uint64_t max(std::uint64_t value) const {
    for (int o = kLanes / 2; o; o /= 2) {
      const std::uint64_t other = __shfl_xor_sync(mask(), static_cast<Word>(value), o);
      value = other > value ? other : value;
    }
    return value;
  }
  __device__ float max(float value) const {
    for (int o = kLanes / 2; o; o /= 2) value = fmaxf(value, __shfl_xor_sync(mask(), value, o));
    return value;
  }

 private:
  /// Of a warp's threads, those of the group.
  __device__ unsigned mask() const {
    if constexpr (kLanes == 32) return ~0u;
    return ((1u << (kLanes & 31)) - 1) << (threadIdx.x & 31u & ~static_cast<unsigned>(kLanes - 1));
  }
};

}  // namespace cordillera::gpu
