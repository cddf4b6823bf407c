#pragma once
// The samples of one row, many at once: the loops that measuring spends its time in, for the widest vectors that the processor
// has. Every sample's numbers are its own, and sums are of integers, so the width changes no bit.
#include <cstddef>
#include <cstdint>

#include "gpu/measure/surface_error_plane.h"

namespace cordillera::gpu {

/// Neighbouring samples of a row; each array as long as count.
struct RowRun {
  const double* sin_lon = nullptr;
  const double* cos_lon = nullptr;
  const std::int32_t* height = nullptr;  ///< kHeightStep_m, or kNoHeight
  std::size_t count = 0;
};

/// |plane - sample| in metres into out, 0 where there is no sample. Returns the greatest.
double row_errors(const PlaneRow& plane, const HeightRange& range, const RowRun& run, double* out);
/// The same greatest, of any number of samples.
double greatest_row_error(const PlaneRow& plane, const HeightRange& range, const RowRun& run);

/// What the samples of a row that have data are.
struct RowHeights {
  std::int32_t lowest = INT32_MAX, highest = INT32_MIN;
  std::uint64_t valid = 0;
};
void see_heights(const std::int32_t* height, std::size_t count, RowHeights& seen);

/// Sum of square_steps(error_m[k]) for k < count <= 256.
void add_squares(const double* error_m, std::size_t count, SquareSum& sum);

}  // namespace cordillera::gpu
