#pragma once
// What keys are made of: a hash that mixes all bits of a number, and the bits of a float or a double. Of those that are not
// negative the bits are in the order of the numbers.
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu {

/// One to one, and without visible order.
CORDILLERA_HD inline std::uint32_t hash32(std::uint32_t v) {
  v ^= v >> 16;
  v *= 0x7feb352du;
  v ^= v >> 15;
  v *= 0x846ca68bu;
  return v ^ (v >> 16);
}

/// The bits of a number as another type of its size.
template <class To, class From>
CORDILLERA_HD inline To same_bits(From from) {
  static_assert(sizeof(To) == sizeof(From));
  union {
    From from;
    To to;
  } bits{from};
  return bits.to;
}
CORDILLERA_HD inline std::uint32_t float_bits(float f) { return same_bits<std::uint32_t>(f); }
CORDILLERA_HD inline float bits_float(std::uint32_t u) { return same_bits<float>(u); }
CORDILLERA_HD inline std::uint64_t double_bits(double d) { return same_bits<std::uint64_t>(d); }
CORDILLERA_HD inline double bits_double(std::uint64_t u) { return same_bits<double>(u); }

}  // namespace cordillera::gpu
