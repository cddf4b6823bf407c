#include "pipeline/faces/pictures/water_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/water_mask.h"

namespace cordillera::pipeline::faces {
namespace {

/// The cell of an axis that a place lies in, places beyond its ends in the outermost.
std::int64_t cell_at(double from_start_deg, int level, std::int64_t tiles) {
  const std::int64_t cells = tiles * kWaterSide;
  return std::clamp<std::int64_t>(std::llround(std::floor(from_start_deg * std::ldexp(kWaterSide, level) / 180)), 0, cells - 1);
}

}  // namespace

std::vector<float> water_pixels(const Terrain& terrain, const Place& place, int level) {
  if (!has_water(terrain.manifest().options())) return {};
  std::map<proto::TileAddress, WaterPixels> masks;
  const auto share = [&](std::int64_t x, std::int64_t y) {
    const proto::TileAddress tile{level, static_cast<std::int32_t>(x / kWaterSide), static_cast<std::int32_t>(y / kWaterSide)};
    const auto [mask, unknown] = masks.try_emplace(tile);
    if (unknown) mask->second = unpack_water(terrain.store().water(tile));
    const auto row = static_cast<std::size_t>(kWaterSide - 1 - y % kWaterSide);
    return mask->second.empty() ? 0.0F : static_cast<float>(mask->second[row * kWaterSide + x % kWaterSide]) / kWater;
  };
  std::array<std::int64_t, kTilePixels> x{};
  for (std::int32_t column = 0; column < kTilePixels; ++column) {
    const double longitude_deg = pixel_longitude_deg(place.z, double{kTilePixels} * place.x + column + 0.5);
    x[static_cast<std::size_t>(column)] = cell_at(longitude_deg + 180, level, proto::tiles_across(level));
  }
  std::vector<float> out;
  out.reserve(std::size_t{kTilePixels} * kTilePixels);
  for (std::int32_t row = 0; row < kTilePixels; ++row) {
    const double latitude_deg = pixel_latitude_deg(place.z, double{kTilePixels} * place.y + row + 0.5);
    const std::int64_t y = cell_at(latitude_deg + 90, level, proto::tiles_up(level));
    for (const std::int64_t at : x) out.push_back(share(at, y));
  }
  return out;
}

}  // namespace cordillera::pipeline::faces
