#pragma once
// A part of the earth.
#include <iterator>
#include <optional>

namespace cordillera::raster {

/// A rectangle in degrees; west <= east, and east may exceed 180.
struct Area {
  double west_deg = 0, south_deg = 0, east_deg = 0, north_deg = 0;
};

/// Of "west, south, east, north" as documents and options have it: there an east below the west lies across the antimeridian.
/// None of fewer than four numbers.
template <class Numbers>
std::optional<Area> area_of(const Numbers& box) {
  if (std::size(box) < 4) return std::nullopt;
  return Area{box[0], box[1], box[2] < box[0] ? box[2] + 360 : box[2], box[3]};
}

}  // namespace cordillera::raster
