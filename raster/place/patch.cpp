#include "raster/place/patch.h"

#include <cmath>

namespace cordillera::raster::patch {

Patch::Patch(std::span<const double> all_x, std::span<const double> all_y, double allowed) : smooth(true) {
  for (std::size_t n = 0; n < kNodes * kNodes; ++n) {
    x[n / kNodes][n % kNodes] = all_x[n];
    y[n / kNodes][n % kNodes] = all_y[n];
  }
  for (std::size_t n = 0; n < kDegree * kDegree; ++n) {
    const Weights &along = kWeights[kStride / 2 + kStride * (n % kDegree)], &up = kWeights[kStride / 2 + kStride * (n / kDegree)];
    const double off_x = weighted(along, along_row(x, up)) - all_x[kNodes * kNodes + n];
    const double off_y = weighted(along, along_row(y, up)) - all_y[kNodes * kNodes + n];
    smooth = smooth && std::abs(off_x) <= allowed && std::abs(off_y) <= allowed;  // false for NaN, too
  }
}

}  // namespace cordillera::raster::patch
