#include "pipeline/faces/pictures/gradient.h"

#include <cmath>
#include <numbers>

#include "pipeline/faces/web_mercator.h"
#include "proto/degrees.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

PixelSize pixel_size(const Place& place, std::int32_t row) {
  const double latitude = pixel_latitude_deg(place.z, double{kTilePixels} * place.y + row + 0.5);
  const double pixel = 2 * std::numbers::pi / std::ldexp(kTilePixels, place.z);  // radians of longitude
  const double e2 = proto::kFlattening * (2 - proto::kFlattening);
  const double sin = std::sin(latitude * proto::kDegree), cos = std::cos(latitude * proto::kDegree);
  const double w = std::sqrt(1 - e2 * sin * sin);
  return {pixel * cos * proto::kSemiMajor_m / w, pixel * cos * proto::kSemiMajor_m * (1 - e2) / (w * w * w)};
}

Gradient gradient(const PixelHeights& grid, std::int32_t row, std::int32_t column, const PixelSize& size) {
  const double centre = grid.at(row, column);
  const auto h = [&](std::int32_t dr, std::int32_t dc) {
    const double height = grid.at(row + dr, column + dc);
    return std::isnan(height) ? centre : height;
  };
  return {(h(-1, 1) + 2 * h(0, 1) + h(1, 1) - h(-1, -1) - 2 * h(0, -1) - h(1, -1)) / (8 * size.east_m),
          (h(-1, -1) + 2 * h(-1, 0) + h(-1, 1) - h(1, -1) - 2 * h(1, 0) - h(1, 1)) / (8 * size.south_m)};
}

}  // namespace cordillera::pipeline::faces
