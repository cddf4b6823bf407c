#include "pipeline/faces/web_mercator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/degrees.h"
#include "proto/lattice.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kSlack = 1e-9;  // of a level: what library versions' logarithms may differ by decides nothing

double pixels_around(int zoom) { return std::ldexp(kTilePixels, zoom); }

/// How many levels finer than the zoom the cell of a pixel's size is. At the equator a cell of level z has half a pixel's side.
double levels_beyond(double latitude_deg) { return -1 - std::log2(std::cos(latitude_deg * proto::kDegree)); }

int wanted_level(int zoom, double latitude_deg) {
  return static_cast<int>(std::ceil(zoom + levels_beyond(latitude_deg) - kSlack));
}

}  // namespace

double pixel_longitude_deg(int zoom, double x) {
  const double around = pixels_around(zoom);
  const double wrapped = x < 0 ? x + around : x >= around ? x - around : x;
  return wrapped / around * 360 - 180;
}

double pixel_latitude_deg(int zoom, double y) {
  return std::atan(std::sinh(kPi * (1 - 2 * y / pixels_around(zoom)))) / proto::kDegree;
}

double longitude_pixel(int zoom, double longitude_deg) { return (longitude_deg + 180) / 360 * pixels_around(zoom); }

double latitude_pixel(int zoom, double latitude_deg) {
  return (1 - std::asinh(std::tan(latitude_deg * proto::kDegree)) / kPi) / 2 * pixels_around(zoom);
}

std::optional<raster::Area> extent_of(const proto::Manifest& manifest) {
  auto extent = raster::area_of(manifest.bounds());
  if (!extent || is_beyond_mercator(*extent)) return std::nullopt;
  extent->south_deg = std::max(extent->south_deg, -kMercatorEnd_deg);
  extent->north_deg = std::min(extent->north_deg, kMercatorEnd_deg);
  return extent->south_deg < extent->north_deg ? extent : std::nullopt;
}

Zooms zooms_of(const proto::Manifest& manifest, const raster::Area& extent) {
  const double middle = raster::middle_latitude_deg(extent);
  Zooms zooms;
  const double fine_enough = std::ceil(manifest.max_level() - levels_beyond(middle) - kSlack);
  zooms.last = std::clamp(static_cast<int>(fine_enough), 0, proto::kMaxLevel);
  // At the equator zoom 0 wants something coarser than there is: level 0 is fine enough.
  const auto coarsest = static_cast<int>(manifest.min_level());
  while (zooms.first < zooms.last && std::max(wanted_level(zooms.first, middle), 0) < coarsest) ++zooms.first;
  return zooms;
}

int level_of(const proto::Manifest& manifest, const Zooms& zooms, int zoom, double latitude_deg) {
  const auto finest = static_cast<int>(manifest.max_level());
  if (zoom >= zooms.last) return finest;
  return std::clamp(wanted_level(zoom, latitude_deg), static_cast<int>(manifest.min_level()), finest);
}

double row_latitude_deg(const raster::Area& extent, int zoom, std::int32_t y) {
  const double north = pixel_latitude_deg(zoom, double{kTilePixels} * y);
  const double south = pixel_latitude_deg(zoom, double{kTilePixels} * (y + 1));
  return (std::max(south, extent.south_deg) + std::min(north, extent.north_deg)) / 2;
}

bool touches(const raster::Area& extent, int zoom, std::int32_t x, std::int32_t y) {
  const double across = std::ldexp(1, zoom), side_deg = 360 / across;
  const double north = latitude_pixel(zoom, extent.north_deg) / kTilePixels;
  const double south = latitude_pixel(zoom, extent.south_deg) / kTilePixels;
  if (y + 1 <= north || y >= south) return false;
  const double west = x * side_deg - 180;
  for (const double turn_deg : {0.0, 360.0}) {
    if (west + turn_deg < extent.east_deg && west + turn_deg + side_deg > extent.west_deg) return true;
  }
  return false;
}

}  // namespace cordillera::pipeline::faces
