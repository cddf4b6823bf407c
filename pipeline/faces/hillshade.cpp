#include "pipeline/faces/hillshade.h"

#include <array>
#include <cmath>
#include <numbers>

#include "pipeline/faces/mesh_pixels.h"
#include "pipeline/faces/png_image.h"
#include "pipeline/faces/raster_tiles.h"
#include "pipeline/faces/tilejson.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kAzimuth_deg = 315, kAltitude_deg = 45;  // where maps have had their light since they were drawn by hand

/// Towards the light; x east, y north.
const proto::Vec3 kLight{std::sin(kAzimuth_deg * kDegree) * std::cos(kAltitude_deg * kDegree),
                         std::cos(kAzimuth_deg * kDegree) * std::cos(kAltitude_deg * kDegree), std::sin(kAltitude_deg * kDegree)};

/// Ground size of a pixel. The grid is conformal on a sphere, so on the ellipsoid the two differ by up to 0.7 %.
struct Ground {
  double east_m = 0, south_m = 0;
};
Ground ground(const Place& place, std::int32_t row) {
  const double latitude = pixel_latitude_deg(place.z, double{kTilePixels} * place.y + row + 0.5);
  const double pixel = 2 * std::numbers::pi / std::ldexp(kTilePixels, place.z);  // radians of longitude
  const double e2 = proto::kFlattening * (2 - proto::kFlattening);
  const double sin = std::sin(latitude * kDegree), cos = std::cos(latitude * kDegree);
  const double w = std::sqrt(1 - e2 * sin * sin);
  return {pixel * cos * proto::kSemiMajor_m / w, pixel * cos * proto::kSemiMajor_m * (1 - e2) / (w * w * w)};
}

/// Horn (1981), doi:10.1109/PROC.1981.11918. Where a neighbour has no data the pixel's own height stands for it.
std::uint8_t shade(const HeightGrid& grid, std::int32_t row, std::int32_t column, const Ground& size) {
  const double centre = grid.at(row, column);
  const auto h = [&](std::int32_t dr, std::int32_t dc) {
    const double height = grid.at(row + dr, column + dc);
    return std::isnan(height) ? centre : height;
  };
  const double east = (h(-1, 1) + 2 * h(0, 1) + h(1, 1) - h(-1, -1) - 2 * h(0, -1) - h(1, -1)) / (8 * size.east_m);
  const double north = (h(-1, -1) + 2 * h(-1, 0) + h(-1, 1) - h(1, -1) - 2 * h(1, 0) - h(1, 1)) / (8 * size.south_m);
  const double lit = (kLight.z - kLight.x * east - kLight.y * north) / std::sqrt(1 + east * east + north * north);
  return static_cast<std::uint8_t>(std::nearbyint(255 * std::max(lit, 0.0)));
}

std::vector<std::uint8_t> pixels(const HeightGrid& grid, const Place& place) {
  std::vector<std::uint8_t> out;
  out.reserve(2 * kTilePixels * kTilePixels);
  for (std::int32_t row = 0; row < kTilePixels; ++row) {
    const Ground size = ground(place, row);
    for (std::int32_t column = 0; column < kTilePixels; ++column) {
      const bool data = !std::isnan(grid.at(row, column));
      out.push_back(data ? shade(grid, row, column, size) : 0);
      out.push_back(data ? 255 : 0);
    }
  }
  return out;
}

std::string grey_png(const std::vector<std::uint8_t>& pixels) { return png(pixels, kTilePixels, Pixel::grey_alpha); }

constexpr RasterStyle kPng{"hillshade/{z}/{x}/{y}.png", pixels, grey_png};

proto::Result<std::optional<Document>> tile(const Terrain& terrain, const Place& place) {
  return raster_tile(terrain, place, kPng);
}
proto::Result<std::optional<Document>> json(const Terrain& terrain, const Place&) {
  return tilejson(terrain, {kPng.path, "png", "Shaded relief, lit from the north-west at 45 degrees"});
}

constexpr std::array<Resource, 2> kResources = {{
    {"hillshade.json", Grid::none, "application/json", "TileJSON 3.0 of the shaded relief", json, Links::tile_templates},
    {kPng.path, Grid::web_mercator, "image/png", "Shaded relief, transparent without data", tile, Links::relative, Absent::no_content},
}};

void each_path(const Terrain& terrain, const PathSink& sink) {
  each_raster_tile(terrain, kPng, sink);
  sink("hillshade.json");
}

}  // namespace

const Face& hillshade() {
  static const Face kFace = {"hillshade", "Leaflet, OpenLayers, QGIS, any map: a picture of the relief", "hillshade.json", kResources,
                             each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
