#pragma once
// What the errors of tiles at the source's pixels add up to.
#include <array>
#include <cstddef>
#include <cstdint>

#include "cordillera.pb.h"

namespace cordillera::pipeline {

/// The number of an error's step: sixteen steps an octave, from a millimetre up. The same on every machine.
std::uint32_t pixel_error_step(double error_m);

/// Sums of tiles, in their order.
class PixelErrorSum {
 public:
  void add(const proto::PixelErrors& tile);
  bool empty() const { return pixels_ == 0; }
  proto::ErrorAtPixels total() const;
  /// How many are farther off than a limit, but for those in the step that it lies in.
  double beyond(double limit_m) const;

 private:
  static constexpr std::size_t kSteps = 512;
  double max_ = 0, sum_squared_ = 0, pixels_ = 0, uncovered_ = 0;
  std::array<double, kSteps> counts_{};
};

}  // namespace cordillera::pipeline
