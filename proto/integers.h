#pragma once
// Division of whole numbers that rounds down, as places on the circle of columns need it.
#include <cstdint>

namespace cordillera::proto {

/// The largest whole number that is not above a / b; b > 0.
constexpr std::int64_t floor_divide(std::int64_t a, std::int64_t b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

/// i on a circle of n: in [0, n); n > 0.
constexpr std::int64_t modulo(std::int64_t i, std::int64_t n) { return ((i % n) + n) % n; }

}  // namespace cordillera::proto
