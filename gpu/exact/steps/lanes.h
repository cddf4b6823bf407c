#pragma once
// Eight numbers at a time on a host, as GCC and Clang have them in any instruction set. Sums and products are those of plain
// code, to the last bit: nothing is contracted, and nothing is added in another order.
#include <cstdint>
#include <cstring>

#include "proto/wide.h"

// How such numbers are passed between functions depends on the instruction set. So the functions below are inlined wherever they
// are used.
#define CORDILLERA_LANES __attribute__((always_inline)) inline

namespace cordillera::gpu::exact {

using Floats = float __attribute__((vector_size(32)));
using Ints = std::int32_t __attribute__((vector_size(32)));  ///< a comparison has -1 where it holds
inline constexpr int kLanes = 8;

template <class T>
CORDILLERA_LANES void load(T& to, const void* from) {
  std::memcpy(&to, from, sizeof to);
}
template <class T>
CORDILLERA_LANES void store(void* to, const T& from) {
  std::memcpy(to, &from, sizeof from);
}
/// 0 where `here` does not hold.
CORDILLERA_LANES void keep(Floats& value, const Ints& here) {
  Ints bits;
  load(bits, &value);
  bits &= here;
  store(&value, bits);
}
CORDILLERA_LANES bool any(const Ints& here) {
  std::uint64_t words[4];
  store(words, here);
  return (words[0] | words[1] | words[2] | words[3]) != 0;
}
/// Bit k: lane k holds.
CORDILLERA_LANES unsigned lanes_of(const Ints& here) {
  const Ints bit = {1, 2, 4, 8, 16, 32, 64, 128};
  std::uint64_t words[4];
  store(words, here & bit);
  const std::uint64_t all = words[0] | words[1] | words[2] | words[3];
  return static_cast<unsigned>(all | all >> 32);
}
CORDILLERA_LANES std::int32_t sum_of(const Ints& values) {
  std::int32_t lane[kLanes], sum = 0;
  store(lane, values);
  for (const std::int32_t value : lane) sum += value;
  return sum;
}

}  // namespace cordillera::gpu::exact
