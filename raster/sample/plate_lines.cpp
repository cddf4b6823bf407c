#include "raster/sample/plate_lines.h"

#include <cmath>

namespace cordillera::raster {

PlateLines::PlateLines(const PixelBlock& block, std::vector<double> u) : block_(block), share_(std::move(u)) {
  const double from = static_cast<double>(block.window.x);
  for (double& at : share_) {
    const bool inside = !std::isnan(at);
    const double left = std::floor(at);
    left_.push_back(inside ? static_cast<std::int32_t>(left - from) : 0);
    nearest_.push_back(inside ? static_cast<std::int32_t>(std::nearbyint(at) - from) : 0);
    at -= left;
  }
  for (Line& line : lines_) line.height.resize(share_.size());
  flat_pixel_.resize(static_cast<std::size_t>(block.window.columns));
  flat_.resize(share_.size());
}

const PlateLines::Line& PlateLines::line(std::int64_t y) {
  Line& line = lines_[static_cast<std::size_t>(y & 1)];
  if (line.y == y) return line;
  line.y = y;
  const double* const from = pixels(y);
  for (std::size_t c = 0; c < share_.size(); ++c) {
    const double a = from[left_[c]], b = from[left_[c] + 1];
    line.height[c] = a + share_[c] * (b - a);
  }
  return line;
}

void PlateLines::heights(double v, double* out) {
  const double top = std::floor(v), down = v - top;
  const auto y = static_cast<std::int64_t>(top);
  const double* const upper = line(y).height.data();
  const double* const lower = line(y + 1).height.data();
  for (std::size_t c = 0; c < share_.size(); ++c) out[c] = upper[c] + down * (lower[c] - upper[c]);
}

/// Into flat_pixel_; false when there are none.
bool PlateLines::find_flat_pixels(std::int64_t y) {
  const double *const above = pixels(y - 1), *const here = pixels(y), *const below = pixels(y + 1);
  const std::size_t n = flat_pixel_.size();
  flat_pixel_.front() = flat_pixel_.back() = 0;
  unsigned any = 0;
  for (std::size_t x = 1; x + 1 < n; ++x) {
    const double h = here[x];
    const bool flat = (above[x - 1] == h) & (above[x] == h) & (above[x + 1] == h) & (here[x - 1] == h) & (here[x + 1] == h) &
                      (below[x - 1] == h) & (below[x] == h) & (below[x + 1] == h);
    flat_pixel_[x] = flat ? 1 : 0;
    any |= flat_pixel_[x];
  }
  return any != 0;
}

const std::uint8_t* PlateLines::flat(double v) {
  const auto y = static_cast<std::int64_t>(std::nearbyint(v));
  if (flat_y_ != y) {
    flat_y_ = y;
    any_flat_ = find_flat_pixels(y);
    if (any_flat_)
      for (std::size_t c = 0; c < flat_.size(); ++c) flat_[c] = flat_pixel_[static_cast<std::size_t>(nearest_[c])];
  }
  return any_flat_ ? flat_.data() : nullptr;
}

}  // namespace cordillera::raster
