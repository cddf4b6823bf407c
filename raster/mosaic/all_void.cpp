#include "raster/mosaic/all_void.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "raster/pixels/decimation.h"

namespace cordillera::raster {

bool is_all_void(RasterSource& raster) {
  constexpr int kMiddle_px = 64;
  const PixelWindow all = raster.all_pixels();
  std::vector<double> heights;
  const auto is_void = [&](const PixelWindow& part) {
    return raster.own_pixels(part, heights).ok() &&
           std::all_of(heights.begin(), heights.end(), [](double height_m) { return std::isnan(height_m); });
  };
  const int across = std::min(all.columns, kMiddle_px), down = std::min(all.rows, kMiddle_px);
  if (!is_void({(all.columns - across) / 2, (all.rows - down) / 2, across, down})) return false;
  if (1.0 * all.columns * all.rows > kMostDecoded_px) return false;
  const int rows = std::max(1, static_cast<int>(kMaxBlockPixels / all.columns));
  for (int y = 0; y < all.rows; y += rows) {
    if (!is_void({0, y, all.columns, std::min(rows, all.rows - y)})) return false;
  }
  return true;
}

}  // namespace cordillera::raster
