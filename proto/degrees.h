#pragma once
// Between degrees and radians.
#include <numbers>

namespace cordillera::proto {

inline constexpr double kDegree = std::numbers::pi / 180;      ///< in radians
inline constexpr double kRadian_deg = 180 / std::numbers::pi;  ///< in degrees

}  // namespace cordillera::proto
