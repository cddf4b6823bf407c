#include "pipeline/faces/water_pixels.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "pipeline/faces/terrain.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/water_mask.h"

namespace cordillera::pipeline::faces {
namespace {

/// The cell of an axis that a place lies in, places beyond its ends in the outermost.
std::int64_t cell_at(double from_start_deg, int level, std::int64_t tiles) {
  const std::int64_t cells = tiles * kWaterSide;
  return std::clamp<std::int64_t>(std::llround(std::floor(from_start_deg * std::ldexp(kWaterSide, level) / 180)), 0, cells - 1);
}

/// Pixels without a height stay so.
void lay_water(const Terrain& terrain, std::span<const float> water, MapWindow& window) {
  constexpr float kMostly = 0.5F;
  const proto::Manifest& manifest = terrain.manifest();
  // Of a mask alone nobody knows the height. Pictures may count from another datum than the raster.
  if (!manifest.options().has_water() || terrain.geoid_name() != manifest.source().vertical_datum()) return;
  for (std::size_t k = 0; k < water.size(); ++k) {
    if (water[k] > kMostly && !std::isnan(window.height_m[k])) window.height_m[k] = manifest.options().water();
  }
}

}  // namespace

std::vector<float> water_pixels(const Terrain& terrain, const MapWindow& window) {
  if (!has_water(terrain.manifest().options())) return {};
  const int level = window.level;
  std::map<proto::TileAddress, WaterPixels> masks;
  const auto share = [&](std::int64_t x, std::int64_t y) {
    const proto::TileAddress tile{level, static_cast<std::int32_t>(x / kWaterSide), static_cast<std::int32_t>(y / kWaterSide)};
    const auto [mask, unknown] = masks.try_emplace(tile);
    if (unknown) mask->second = unpack_water(terrain.store().water(tile));
    const auto row = static_cast<std::size_t>(kWaterSide - 1 - y % kWaterSide);
    return mask->second.empty() ? 0.0F : static_cast<float>(mask->second[row * kWaterSide + x % kWaterSide]) / kWater;
  };
  std::vector<std::int64_t> x;
  for (std::int32_t column = 0; column < window.columns; ++column) {
    const double longitude_deg = pixel_longitude_deg(window.zoom, static_cast<double>(window.west + column) + 0.5);
    x.push_back(cell_at(longitude_deg + 180, level, proto::tiles_across(level)));
  }
  std::vector<float> out;
  out.reserve(static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows));
  for (std::int32_t row = 0; row < window.rows; ++row) {
    const double latitude_deg = pixel_latitude_deg(window.zoom, static_cast<double>(window.north + row) + 0.5);
    const std::int64_t y = cell_at(latitude_deg + 90, level, proto::tiles_up(level));
    for (const std::int64_t at : x) out.push_back(share(at, y));
  }
  return out;
}

proto::Result<std::vector<float>> draw_shown_heights(const Terrain& terrain, MapWindow& window) {
  if (const auto done = draw_heights(terrain, window); !done) return done.problem();
  std::vector<float> water = water_pixels(terrain, window);
  lay_water(terrain, water, window);
  return water;
}

}  // namespace cordillera::pipeline::faces
