#include "pipeline/faces/pictures/hillshade.h"

#include <array>
#include <cmath>

#include "pipeline/faces/pictures/gradient.h"
#include "pipeline/faces/pictures/png_image.h"
#include "pipeline/faces/pictures/raster_tiles.h"
#include "pipeline/faces/tilejson.h"
#include "proto/degrees.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr double kAzimuth_deg = 315, kAltitude_deg = 45;  // where maps have had their light since they were drawn by hand

/// Towards the light; x east, y north.
const proto::Vec3 kLight{std::sin(kAzimuth_deg * proto::kDegree) * std::cos(kAltitude_deg * proto::kDegree),
                         std::cos(kAzimuth_deg* proto::kDegree) * std::cos(kAltitude_deg* proto::kDegree),
                         std::sin(kAltitude_deg* proto::kDegree)};

std::uint8_t shade(const Gradient& rise) {
  const double lit =
      (kLight.z - kLight.x * rise.east - kLight.y * rise.north) / std::sqrt(1 + rise.east * rise.east + rise.north * rise.north);
  return static_cast<std::uint8_t>(std::nearbyint(255 * std::max(lit, 0.0)));
}

std::vector<std::uint8_t> pixels(const Terrain&, const PixelHeights& grid, const Place& place) {
  std::vector<std::uint8_t> out;
  out.reserve(2 * kTilePixels * kTilePixels);
  for (std::int32_t row = 0; row < kTilePixels; ++row) {
    const PixelSize size = pixel_size(place, row);
    for (std::int32_t column = 0; column < kTilePixels; ++column) {
      const bool data = !std::isnan(grid.at(row, column));
      out.push_back(data ? shade(gradient(grid, row, column, size)) : 0);
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
    {kPng.path, Grid::web_mercator, "image/png", "Shaded relief, transparent outside the data", tile, Links::relative,
     Absent::no_content},
}};

void each_path(const Terrain& terrain, const PathSink& sink) {
  each_raster_tile(terrain, kPng, sink);
  sink("hillshade.json");
}

}  // namespace

const Face& hillshade() {
  static const Face kFace = {"hillshade", "Leaflet, OpenLayers, QGIS, any map: a picture of the relief", "hillshade.json",
                             kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
