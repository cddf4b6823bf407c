#pragma once
// Heights as colours that programs read back: one way for each encoding that map clients know.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/faces/pictures/pixel_heights.h"
#include "pipeline/faces/pictures/png_image.h"
#include "pipeline/faces/pictures/webp_image.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {

/// Neither encoding can say that there is no data, and a transparent pixel loses its colour in browsers, which makes -10000 m of
/// it. Far outside the data it is the geoid, to which what lies between goes down.
inline constexpr double kNoDataHeight_m = 0;

/// height = count * step_m - base_m; red is the highest byte of count.
struct HeightColour {
  double base_m = 0, step_m = 0;

  std::array<std::uint8_t, 3> operator()(double height_m) const {
    const double steps = std::nearbyint(((std::isnan(height_m) ? kNoDataHeight_m : height_m) + base_m) / step_m);
    const auto count = static_cast<std::uint32_t>(std::clamp(steps, 0.0, double{0xffffff}));
    return {static_cast<std::uint8_t>(count >> 16), static_cast<std::uint8_t>(count >> 8), static_cast<std::uint8_t>(count)};
  }
};

inline std::vector<std::uint8_t> coloured(const PixelHeights& grid, const HeightColour& colour) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(3 * kTilePixels * kTilePixels);
  for (std::int32_t row = 0; row < kTilePixels; ++row) {
    for (std::int32_t column = 0; column < kTilePixels; ++column) {
      const auto rgb = colour(grid.at(row, column));
      pixels.insert(pixels.end(), rgb.begin(), rgb.end());
    }
  }
  return pixels;
}

inline std::string rgb_png(const std::vector<std::uint8_t>& pixels) { return png(pixels, kTilePixels, Pixel::rgb); }
inline std::string rgb_webp(const std::vector<std::uint8_t>& pixels) { return webp(pixels, kTilePixels); }

}  // namespace cordillera::pipeline::faces
