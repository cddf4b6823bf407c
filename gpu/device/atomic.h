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
  if ((threadIdx.x & 31u) == static_cast<unsigned>(__ffs(static_cast<int>(same)) - 1))
    atomicAdd(at, static_cast<unsigned>(__popc(same)));
#else
  ++*at;
#endif
}

/// True in a thread of a host that shares its work with no other: it need not lock memory, which is slow.
inline thread_local bool works_alone = false;

/// How many far places in memory a thread asks for before it looks at the first: a GPU waits long for each, a CPU looks ahead.
#ifdef __CUDA_ARCH__
inline constexpr std::uint32_t kAtOnce = 4;
#else
inline constexpr std::uint32_t kAtOnce = 1;
#endif

/// *at = value, for which several threads may ask at once; all of them ask for the same.
template <class T>
CORDILLERA_HD void set_shared(T* at, T value) {
#ifdef __CUDA_ARCH__
  *at = value;
#else
  __atomic_store(at, &value, __ATOMIC_RELAXED);
#endif
}
/// *at, which others may be setting.
template <class T>
CORDILLERA_HD T get_shared(const T* at) {
#ifdef __CUDA_ARCH__
  return *at;
#else
  T value;
  __atomic_load(at, &value, __ATOMIC_RELAXED);
  return value;
#endif
}

/// *at = max(*at, value), from any thread of a host, too. Most threads find it high enough already.
CORDILLERA_HD inline void raise_to(std::uint32_t* at, std::uint32_t value) {
#ifdef __CUDA_ARCH__
  if (*static_cast<volatile std::uint32_t*>(at) < value) atomicMax(at, value);
#else
  std::uint32_t before = __atomic_load_n(at, __ATOMIC_RELAXED);
  while (before < value && !__atomic_compare_exchange_n(at, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#endif
}

/// *at += n and *at = max(*at, value), from threads of a device; a host's alone.
CORDILLERA_HD inline void add_to(std::uint64_t* at, std::uint64_t n) {
#ifdef __CUDA_ARCH__
  if (n) atomicAdd(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(n));
#else
  *at += n;
#endif
}
CORDILLERA_HD inline void raise_to(std::uint64_t* at, std::uint64_t value) {
#ifdef __CUDA_ARCH__
  atomicMax(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  if (*at < value) *at = value;
#endif
}

/// *at = min(*at, value), likewise.
CORDILLERA_HD inline void lower_to(std::uint64_t* at, std::uint64_t value) {
#ifdef __CUDA_ARCH__
  atomicMin(reinterpret_cast<unsigned long long*>(at), static_cast<unsigned long long>(value));
#else
  std::uint64_t before = __atomic_load_n(at, __ATOMIC_RELAXED);
  if (works_alone) {
    if (value < before) *at = value;
    return;
  }
  while (value < before && !__atomic_compare_exchange_n(at, &before, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {}
#endif
}

}  // namespace cordillera::gpu
