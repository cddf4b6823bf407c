#pragma once
// Counting from many threads. Integer sums only: their order does not show in the result.
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu {

CORDILLERA_HD inline std::uint32_t fetch_add(std::uint32_t* at, std::uint32_t n) {
#ifdef __CUDA_ARCH__
  return atomicAdd(at, n);
#else
  const std::uint32_t before = *at;
  *at += n;
  return before;
#endif
}

/// Adds 1. Threads of a warp that count the same thing add up first: neighbours usually do.
CORDILLERA_HD inline void count_one(std::uint32_t* at) {
#ifdef __CUDA_ARCH__
  const unsigned same = __match_any_sync(__activemask(), reinterpret_cast<std::uintptr_t>(at));
  if ((threadIdx.x & 31u) == static_cast<unsigned>(__ffs(static_cast<int>(same)) - 1)) atomicAdd(at, static_cast<unsigned>(__popc(same)));
#else
  ++*at;
#endif
}

/// *at = max(*at, value). Most threads find it high enough already.
CORDILLERA_HD inline void raise_to(std::uint32_t* at, std::uint32_t value) {
#ifdef __CUDA_ARCH__
  if (*static_cast<volatile std::uint32_t*>(at) < value) atomicMax(at, value);
#else
  if (*at < value) *at = value;
#endif
}

}  // namespace cordillera::gpu
