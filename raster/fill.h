#pragma once
// Voids filled from the nearest valid pixels around them.
#include <vector>

namespace cordillera::raster {

/// How far, in pixels, a void looks for valid pixels. Voids farther than this from data in all eight directions stay void.
inline constexpr int kFillReach_px = 100;

/// Replaces NaN by the mean of the first valid pixel in each of the eight directions, weighted by 1 / distance^2. A pixel's result
/// depends on the pixels within kFillReach_px only, so windows that carry such a margin agree. columns*rows values, row-major.
void fill_voids(std::vector<double>& values, int columns, int rows);

}  // namespace cordillera::raster
