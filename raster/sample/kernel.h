#pragma once
// One resampling kernel per dataset: a triangle in source pixels, exact at pixel centres, widened per axis when reducing.
#include <vector>

#include "raster/pixels/pixels.h"

namespace cordillera::raster {

/// What the kernel needs to know of the source, fixed for a dataset and a lattice.
struct KernelFrame {
  int columns = 0, rows = 0;
  int period = 0;                   ///< columns around the earth, 0: none
  bool point = false;               ///< pixels are points: data reaches from centre to centre; else their areas are covered
  bool goes_on = false;             ///< with others' pixels beyond the outermost: points then reach to those
  double ratio_x = 1, ratio_y = 1;  ///< half width of the triangle in pixels, >= 1
};

/// A position in the source, in pixel centres (pixel c has its centre at c), snapped: what lies a millionth of a pixel beside a
/// centre or an edge lies on it, so that rounding of a projection cannot blur a coinciding sample.
struct PixelPosition {
  double u = 0, v = 0;
};

/// A window of pixels in memory, as Pixels::read gives it.
struct PixelBlock {
  PixelWindow window;
  std::vector<double> heights;
  double at(std::int64_t x, std::int64_t y) const {
    return heights[static_cast<std::size_t>(y - window.y) * window.columns + static_cast<std::size_t>(x - window.x)];
  }
};

class Kernel {
 public:
  explicit Kernel(const KernelFrame& frame) : frame_(frame), reduces_(frame.ratio_x > 1 || frame.ratio_y > 1) {}

  /// In place: pixel positions (edges at integers; NaN allowed) -> u and v of places, both NaN outside the raster.
  void locate(double* x, double* y, std::size_t count) const;
  /// Each axis by itself: NaN outside.
  double locate_u(double px) const;
  double locate_v(double py) const;
  /// Pixels that valid(), flat() and value() look at around the places in the box; near: all but the widened triangle.
  PixelWindow around(const PixelPosition& low, const PixelPosition& high) const;
  PixelWindow near(const PixelPosition& place) const;

  /// Whether there is data at the place: some pixel that covers it is valid, or (point) all corners of its cell are.
  bool valid(const PixelPosition& place, const PixelBlock& block) const;
  /// The nearest pixel and its eight neighbours are valid and equal: still water.
  bool flat(const PixelPosition& place, const PixelBlock& block) const;
  /// Height at a valid place.
  double value(const PixelPosition& place, const PixelBlock& block) const;
  /// Heights at a row of places; NaN outside and where a void pixel takes part: valid() and value() know more. Everywhere, where
  /// the kernel reduces. level: 1 where all pixels that take part are equal; flat() is false elsewhere.
  void heights(const double* u, const double* v, std::size_t count, const PixelBlock& block, double* out,
               std::uint8_t* level) const;

  /// The widened triangle in strips: add() with blocks from top to bottom that together hold around(place), then the mean. The
  /// order of additions is the same however the strips are cut.
  struct Sum {
    double value = 0, weight = 0;
    double mean() const { return value / weight; }
  };
  void add(const PixelPosition& place, const PixelBlock& block, Sum& sum) const;
  bool reduces() const { return reduces_; }

 private:
  double bilinear(const PixelPosition& place, const PixelBlock& block) const;
  /// How far data may reach beyond the outermost centres.
  double rim() const { return !frame_.point ? 0.5 : frame_.goes_on ? 1 : 0; }
  KernelFrame frame_;
  bool reduces_;
};

}  // namespace cordillera::raster
