#pragma once
// Which raw values are heights at all.
#include <string>

#include "raster/dataset.h"

namespace cordillera::raster {

/// A raw value is valid when it is finite, no sentinel, and not the declared nodata value.
class Validity {
 public:
  explicit Validity(const Dataset& dataset);

  bool operator()(double raw) const {
    if (!(raw > -kSentinel && raw < kSentinel)) return false;  // NaN, infinities, +-3.4e38
    return !(raw >= nodata_low_ && raw <= nodata_high_);
  }
  /// For the manifest: "value -9999", "mask band", "none", ...
  const std::string& text() const { return text_; }

 private:
  static constexpr double kSentinel = 1e30;
  double nodata_low_ = 1, nodata_high_ = 0;  ///< empty interval: no nodata value
  std::string text_;
};

}  // namespace cordillera::raster
