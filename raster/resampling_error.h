#pragma once
// Which source pixels are asked how far the lattice is from them. The asking itself is RasterSource::resampling_error_m.
#include <cstdint>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::raster {

/// A rectangle of pixels to choose from, and what choosing one costs: a pixel makes us read window_px around it, in whole blocks.
struct NetFrame {
  std::int64_t x = 0, y = 0, columns = 0, rows = 0;
  std::int64_t window_columns = 1, window_rows = 1;
  std::int64_t block_columns = 1, block_rows = 1;
};

/// Every column with every row.
struct PixelNet {
  std::vector<std::int64_t> columns, rows;  ///< ascending, none twice
};

inline constexpr std::int64_t kNetPixels = 4096;
/// Pixels that a net may make us decode or look at: a second of a slow core's work.
inline constexpr std::int64_t kNetCost_px = std::int64_t{16} << 20;

/// All pixels when they are few, else kNetPixels of them, evenly spread and not in step with any lattice. Where even so many would
/// cost more than kNetCost_px they stand in fewer blocks, or are fewer; never fewer than one of a rectangle with pixels.
PixelNet spread_net(const NetFrame& frame);

/// Height in steps at (fx, fy), both 0..1 from the south-west, of a cell cut from south-west to north-east. cell: 2 x 2, none void.
double cell_height_steps(const proto::Samples& cell, double fx, double fy);

}  // namespace cordillera::raster
