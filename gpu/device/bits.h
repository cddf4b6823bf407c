#pragma once
// What keys are made of: a hash that mixes all bits of a number, and a float's bits. Of floats that are not negative the bits are
// in the order of the numbers.
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu {

CORDILLERA_HD inline std::uint32_t hash32(std::uint32_t v) {
  v ^= v >> 16;
  v *= 0x7feb352du;
  v ^= v >> 15;
  v *= 0x846ca68bu;
  return v ^ (v >> 16);
}
CORDILLERA_HD inline std::uint32_t float_bits(float f) {
  union {
    float f;
    std::uint32_t u;
  } bits{f};
  return bits.u;
}
CORDILLERA_HD inline float bits_float(std::uint32_t u) {
  union {
    std::uint32_t u;
    float f;
  } bits{u};
  return bits.f;
}

}  // namespace cordillera::gpu
