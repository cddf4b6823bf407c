#pragma once
// Rows of samples on their way from places in the raster into Samples.
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "proto/mesh.h"
#include "raster/sample/kernel.h"

namespace cordillera::raster {

/// Samples side by side, each at a place of the raster: u and v as Kernel::locate gives them.
struct PlacedRow {
  std::size_t count = 0;
  const double *u = nullptr, *v = nullptr;
  const double* above_m = nullptr;  ///< undulations
};

/// Least and greatest of the places that are none outside.
class FiniteRange {
 public:
  void add(const double* places, std::size_t count);
  double low() const { return low_; }
  double high() const { return high_; }
  bool empty() const { return low_ > high_; }

 private:
  double low_ = INFINITY, high_ = -INFINITY;
};

/// The row's samples, from `from` on. height_m: above the geoid, as Kernel::heights gives them; where a void pixel takes part the
/// kernel is asked again. flat: 1 on still water, one a sample; null: nowhere. Voids and heights out of range are left void.
void put_row(const Kernel& kernel, const PixelBlock& block, const PlacedRow& row, const double* height_m,
             const std::uint8_t* flat, std::size_t from, proto::Samples& samples);
/// One of them, above the ellipsoid.
void put(double height_m, bool flat, std::size_t at, proto::Samples& samples);

}  // namespace cordillera::raster
