#include "pipeline/contours/contour_grid.h"

#include <cmath>

#include "pipeline/faces/pictures/pixel_heights.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::contours {
namespace {

using faces::kTilePixels;

constexpr double kStep_m = 0.001;
constexpr std::int32_t kShore = 250, kSea = -1;  // steps; the shore is where the blue of the relief ends

std::int32_t steps(double height_m) {
  if (std::isnan(height_m)) return raster::kNoHeightHere;
  const auto rounded = static_cast<std::int32_t>(std::lround(height_m / kStep_m));
  return std::abs(rounded) <= kShore ? kSea : rounded;
}

/// Rows of pixels that are drawn from one level, counted from the tile's first.
struct Band {
  int level = 0;
  std::int32_t first = 0, end = 0;
};

/// From the north: of the tile above, of this one, of the one below.
std::vector<Band> bands_of(const faces::Terrain& terrain, const raster::Area& extent, const faces::Zooms& zooms,
                           const faces::Place& place) {
  const auto level = [&](std::int32_t y) {
    return faces::level_of(terrain.manifest(), zooms, place.z, faces::row_latitude_deg(extent, place.z, y));
  };
  std::vector<Band> bands;
  for (const Band& band : {Band{level(place.y - 1), -kReach, 0}, Band{level(place.y), 0, kTilePixels},
                           Band{level(place.y + 1), kTilePixels, kTilePixels + kReach}}) {
    if (!bands.empty() && bands.back().level == band.level)
      bands.back().end = band.end;
    else
      bands.push_back(band);
  }
  return bands;
}

}  // namespace

proto::Result<std::optional<raster::HeightSteps>> contour_grid(const faces::Terrain& terrain, const faces::Place& place) {
  using Grid = std::optional<raster::HeightSteps>;
  const auto extent = faces::extent_of(terrain.manifest());
  if (!extent || !faces::touches(*extent, place.z, place.x, place.y)) return Grid();
  const faces::Zooms zooms = faces::zooms_of(terrain.manifest(), *extent);
  if (!zooms.holds(place.z)) return Grid();
  constexpr std::int32_t kSide = kTilePixels + 2 * kReach;
  raster::HeightSteps grid{kSide, kSide, {}};
  const std::int64_t west = std::int64_t{kTilePixels} * place.x, north = std::int64_t{kTilePixels} * place.y;
  for (const Band& band : bands_of(terrain, *extent, zooms, place)) {
    faces::MapWindow window{place.z, band.level, west - kReach, north + band.first, kSide, band.end - band.first, {}};
    if (const auto done = faces::filled_window(terrain, window, faces::Beyond::clear); !done) return done.problem();
    for (const double height_m : window.height_m) grid.height.push_back(steps(height_m));
  }
  return Grid(std::move(grid));
}

}  // namespace cordillera::pipeline::contours
