#pragma once
// Where a vertex of a .drc tile is, by the formula that is published for clients.
#include <cmath>
#include <cstddef>
#include <numbers>

#include "pipeline/encode/decode.h"

namespace cordillera::pipeline {

struct DrcPoint {
  double longitude_deg = 0, latitude_deg = 0, height_m = 0;
};
inline DrcPoint drc_point(const DecodedDrc& tile, std::size_t vertex) {
  const auto& [u, v, h] = tile.points[vertex];
  if (tile.web_mercator) {
    const double tiles = std::ldexp(1, tile.z), up = 1 - 2 * (tile.y + 1 - static_cast<double>(v) / tile.side) / tiles;
    return {-180 + (tile.x + static_cast<double>(u) / tile.side) * 360 / tiles,
            std::atan(std::sinh(std::numbers::pi * up)) * 180 / std::numbers::pi, h * tile.height_step};
  }
  const double degrees = 180 / std::ldexp(1, tile.z);
  return {-180 + (tile.x + static_cast<double>(u) / tile.side) * degrees,
          -90 + (tile.y + static_cast<double>(v) / tile.side) * degrees, h * tile.height_step};
}

}  // namespace cordillera::pipeline
