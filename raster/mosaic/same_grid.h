#pragma once
// Rasters that were cut from one grid: their pixels go on from one to the next.
#include <cstdint>
#include <optional>

#include "raster/source.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {

/// How far beyond its sides a raster looks at others' pixels. A kernel that is wider than that leaves the rest out.
inline constexpr std::int64_t kMostBeyond_px = 64;

/// By what is told of two rasters without opening them: pixels of areas, the same CRS, vertical datum and size of pixels. Others
/// have no grid in common.
bool may_share_grid(const proto::Source& a, const proto::Source& b);

/// Where b's first pixel lies in a's pixels; nullopt: its pixels are not a's, gone on with.
struct PixelShift {
  std::int64_t x = 0, y = 0;
};
std::optional<PixelShift> shift_on_grid(const RasterSource& a, const RasterSource& b);

}  // namespace cordillera::raster
