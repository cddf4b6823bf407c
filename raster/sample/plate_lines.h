#pragma once
// Resampling where columns and rows of the lattice are columns and rows of the source, scaled: what a line of pixels gives to a
// line of samples is worked out once and used for every line of samples between it and the next. The same bits as Kernel gives,
// sample by sample.
#include <array>
#include <cstdint>
#include <vector>

#include "raster/sample/kernel.h"

namespace cordillera::raster {

/// Borrows kernel and block, for a kernel that does not reduce.
class PlateLines {
 public:
  /// u: of each column of samples, NaN where it lies outside; block holds around() of all places that will be asked for.
  PlateLines(const PixelBlock& block, std::vector<double> u);

  /// Heights along the row at v, one a column; NaN where a void pixel takes part (Kernel knows more) or u is.
  void heights(double v, double* out);
  /// Still water along the row at v, one a column, as Kernel::flat says. Null: nowhere.
  const std::uint8_t* flat(double v);

 private:
  /// A line of pixels at the samples' columns.
  struct Line {
    std::int64_t y = INT64_MIN;
    std::vector<double> height;
  };
  const Line& line(std::int64_t y);
  const double* pixels(std::int64_t y) const {
    return block_.heights.data() + static_cast<std::size_t>(y - block_.window.y) * block_.window.columns;
  }
  bool find_flat_pixels(std::int64_t y);

  const PixelBlock& block_;
  std::vector<std::int32_t> left_, nearest_;  ///< indexed by column: pixel, from the block's first
  std::vector<double> share_;                 ///< indexed by column: of the pixel to the right
  std::array<Line, 2> lines_;                 ///< by parity of y
  std::int64_t flat_y_ = INT64_MIN;           ///< of flat_
  bool any_flat_ = false;
  std::vector<std::uint8_t> flat_pixel_, flat_;
};

}  // namespace cordillera::raster
