#include "raster/place/patch.h"

#include <cmath>

#include "proto/wide.h"

namespace cordillera::raster::patch {
namespace {

/// kWeights by node, for loops along a row.
constexpr std::array<std::array<double, kCells>, kNodes> kNodeWeights = [] {
  std::array<std::array<double, kCells>, kNodes> all{};
  for (std::size_t node = 0; node < kNodes; ++node)
    for (std::size_t cell = 0; cell < kCells; ++cell) all[node][cell] = kWeights[cell][node];
  return all;
}();

CORDILLERA_WIDE void weigh(const std::array<double, kNodes>& line, int first, int count, double* to) {
  const double *w0 = kNodeWeights[0].data() + first, *w1 = kNodeWeights[1].data() + first, *w2 = kNodeWeights[2].data() + first,
               *w3 = kNodeWeights[3].data() + first, *w4 = kNodeWeights[4].data() + first;
  for (int k = 0; k < count; ++k) to[k] = w0[k] * line[0] + w1[k] * line[1] + w2[k] * line[2] + w3[k] * line[3] + w4[k] * line[4];
}

}  // namespace

void Patch::places(int row, int first, int count, double* to_x, double* to_y) const {
  const Weights& up = kWeights[static_cast<std::size_t>(row)];
  weigh(along_row(x, up), first, count, to_x);
  weigh(along_row(y, up), first, count, to_y);
}

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
