#include "pipeline/faces/pictures/pixel_heights.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pipeline/faces/map_window.h"
#include "pipeline/faces/outline_fill.h"
#include "pipeline/faces/water_pixels.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::int32_t kSide = kTilePixels + 2 * kMargin;

MapWindow window_of(const Place& place, int level) {
  return {place.z, level, std::int64_t{kTilePixels} * place.x - kMargin, std::int64_t{kTilePixels} * place.y - kMargin, kSide,
          kSide,   {}};
}

template <class Shows>
bool any_pixel(const PixelHeights& grid, const Shows& shows) {
  for (std::int32_t r = 0; r < kTilePixels; ++r) {
    for (std::int32_t c = 0; c < kTilePixels; ++c) {
      if (shows(grid.at(r, c))) return true;
    }
  }
  return false;
}

void clear_outside(const OutlineFill& outline, const std::vector<double>& data_m, MapWindow& window) {
  for (std::size_t k = 0; k < data_m.size(); ++k) {
    const auto row = static_cast<std::int64_t>(k) / window.columns, column = static_cast<std::int64_t>(k) % window.columns;
    if (std::isnan(data_m[k]) && !outline.inside(window.zoom, window.west + column, window.north + row))
      window.height_m[k] = std::numeric_limits<double>::quiet_NaN();
  }
}

bool gaps_in(const std::vector<double>& height_m) {
  return std::any_of(height_m.begin(), height_m.end(), [](double h) { return std::isnan(h); });
}

/// Fills a window that was drawn. False: it stays as it is.
proto::Result<bool> fill_gaps(const Terrain& terrain, MapWindow& window, Beyond beyond) {
  if (!gaps_in(window.height_m)) return false;
  const auto outline = terrain.outline();
  if (!outline) return outline.problem();
  if (beyond == Beyond::clear && !(*outline)->holes_in(window)) return false;
  const std::vector<double> data_m = window.height_m;
  if (const auto done = (*outline)->fill(terrain, window); !done) return done.problem();
  if (beyond == Beyond::clear) clear_outside(**outline, data_m, window);
  return true;
}

}  // namespace

proto::Result<std::optional<PixelHeights>> pixel_heights(const Terrain& terrain, const Place& place) {
  const auto extent = extent_of(terrain.manifest());
  if (!extent || !touches(raster::unwrapped(*extent), place.z, place.x, place.y)) return std::optional<PixelHeights>();
  const Zooms zooms = zooms_of(terrain.manifest(), *extent);
  if (!zooms.holds(place.z)) return std::optional<PixelHeights>();
  PixelHeights grid;
  grid.level = level_of(terrain.manifest(), zooms, place.z, row_latitude_deg(*extent, place.z, place.y));
  grid.side = kSide;
  MapWindow window = window_of(place, grid.level);
  auto water = draw_shown_heights(terrain, window);
  if (!water) return water.problem();
  grid.water = std::move(*water);
  grid.height_m = std::move(window.height_m);
  grid.data = any_pixel(grid, [](double height_m) { return !std::isnan(height_m); });
  return std::optional(std::move(grid));
}

proto::Result<std::optional<PixelHeights>> filled_grid(const Terrain& terrain, const Place& place, Beyond beyond) {
  auto grid = pixel_heights(terrain, place);
  if (!grid || !*grid) return grid;
  PixelHeights& heights = **grid;
  MapWindow window = window_of(place, heights.level);
  window.height_m = std::move(heights.height_m);
  const auto filled = fill_gaps(terrain, window, beyond);
  if (!filled) return filled.problem();
  heights.height_m = std::move(window.height_m);
  if (*filled)
    heights.data = heights.data || any_pixel(heights, [](double height_m) { return !std::isnan(height_m) && height_m != 0; });
  return grid;
}

proto::Result<void> filled_window(const Terrain& terrain, MapWindow& window, Beyond beyond) {
  if (const auto drawn = draw_shown_heights(terrain, window); !drawn) return drawn.problem();
  if (const auto filled = fill_gaps(terrain, window, beyond); !filled) return filled.problem();
  return {};
}

}  // namespace cordillera::pipeline::faces
