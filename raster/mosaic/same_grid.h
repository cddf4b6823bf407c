#pragma once
// Rasters that were cut from one grid: their pixels go on from one to the next.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "raster/mosaic/pixel_grid.h"
#include "raster/source.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {

/// How far beyond its sides a raster looks at others' pixels. A kernel that is wider than that leaves the rest out.
inline constexpr std::int64_t kMostBeyond_px = 64;

/// By what is told of two rasters without opening them: the same CRS, vertical datum and size of pixels, be they areas or points.
/// Others have no grid in common.
bool may_share_grid(const proto::Source& a, const proto::Source& b);

PixelGrid grid_of(const RasterSource& source);

/// Where b's first pixel lies, in pixels of a; nullopt: they are not of one grid.
struct PixelShift {
  std::int64_t x = 0, y = 0;
};
std::optional<PixelShift> shift_on_grid(const PixelGrid& a, const PixelGrid& b);

/// Whether no pixel of a raster whose first pixel lies there is beyond another one's.
bool lies_within(const PixelWindow& all, const PixelShift& shift, const PixelWindow& other);

/// Another raster of the grid. all: its pixels, as it counts them; shift: where the first of them lies for the one that asks.
struct GridNeighbour {
  std::size_t member = 0;
  PixelShift shift;
  PixelWindow all;
};
using ReadPixels = std::function<proto::Result<void>(std::size_t member, const PixelWindow& part, std::vector<double>& heights)>;
/// Fills what of the window lies beyond the pixels of a raster (all) and is NaN: from its neighbours, of the first that has it.
proto::Result<void> fill_beyond(const PixelWindow& all, const std::vector<GridNeighbour>& neighbours, const PixelWindow& window,
                                std::vector<double>& heights, const ReadPixels& read);

}  // namespace cordillera::raster
