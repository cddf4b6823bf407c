#pragma once
#include <cstddef>
#include <cstdint>

namespace cordillera::raster {

/// A rectangle of pixels. Columns may run beyond the raster: wrapped where it closes around the earth, void elsewhere.
struct PixelWindow {
  std::int64_t x = 0, y = 0;
  int columns = 0, rows = 0;
  std::size_t count() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
};

/// One pixel of a raster.
struct PixelNumber {
  std::int32_t column = 0, row = 0;
};

}  // namespace cordillera::raster
