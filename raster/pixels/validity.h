#pragma once
// Which raw values are heights at all.
#include <string>

#include "raster/open/dataset.h"

namespace cordillera::raster {

/// A raw value is valid when it is finite, no sentinel, and neither a declared nodata value nor the one that was asked for. A
/// NetCDF variable may declare two, _FillValue and missing_value, and the least and the greatest valid value (CF
/// Conventions 2.5.1): GDAL knows the first alone, and the bounds where there are both. Bounds of packed values are left to it.
class Validity {
 public:
  explicit Validity(const Dataset& dataset);

  bool operator()(double raw) const {
    // NaN, infinities and +-3.4e38 are beyond a sentinel. No branches: this is asked of every pixel.
    return usual_.holds(raw) & !declared_.holds(raw) & !missing_.holds(raw) & !asked_.holds(raw);
  }
  /// For the manifest: "value -9999", "mask band", "none", ...
  const std::string& text() const { return text_; }

 private:
  static constexpr double kSentinel = 1e30;

  /// A value, and what it may be rounded to. Empty: no such value.
  struct ValueRange {
    double low = 1, high = 0;
    bool holds(double raw) const { return (raw >= low) & (raw <= high); }
    bool empty() const { return low > high; }
  };
  static ValueRange around(double value, GDALDataType type);
  void take_words_of_netcdf(const Dataset& dataset);

  ValueRange usual_{-kSentinel, kSentinel}, declared_, missing_, asked_;
  std::string text_;
};

}  // namespace cordillera::raster
