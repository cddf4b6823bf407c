#include "pipeline/faces/outline_fill.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "pipeline/faces/face.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/faces/water_pixels.h"
#include "pipeline/faces/web_mercator.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::int32_t kRounds = 8;  // of averaging at each zoom: what a coarser pixel leaves as a step is two pixels wide

constexpr std::int32_t kFewPixels = 8;  // more than the pixels beside a window, which halving does not lessen

bool has_gaps(const MapWindow& window) {
  return std::any_of(window.height_m.begin(), window.height_m.end(), [](double height_m) { return std::isnan(height_m); });
}

MapWindow grown(const MapWindow& window, std::int32_t by) {
  return {window.zoom, window.level, window.west - by, window.north - by, window.columns + 2 * by, window.rows + 2 * by, {}};
}

/// What lies under a window one zoom coarser, and a pixel more on each side to interpolate with.
MapWindow coarser(const MapWindow& fine) {
  MapWindow coarse{fine.zoom - 1, fine.level, (fine.west >> 1) - 1, (fine.north >> 1) - 1, 0, 0, {}};
  coarse.columns = static_cast<std::int32_t>(((fine.west + fine.columns - 1) >> 1) + 2 - coarse.west);
  coarse.rows = static_cast<std::int32_t>(((fine.north + fine.rows - 1) >> 1) + 2 - coarse.north);
  return coarse;
}

/// Between the four nearest centres of the coarser zoom.
double interpolated(const MapWindow& coarse, std::int64_t column, std::int64_t row) {
  const std::int64_t c = column >> 1, r = row >> 1;
  const std::int64_t beside = (column & 1) != 0 ? c + 1 : c - 1, above = (row & 1) != 0 ? r + 1 : r - 1;
  const double near = 0.75 * coarse.at(c, r) + 0.25 * coarse.at(beside, r);
  const double far = 0.75 * coarse.at(c, above) + 0.25 * coarse.at(beside, above);
  return 0.75 * near + 0.25 * far;
}

/// Gaps become the mean of their four neighbours, some times over. What lies kRounds within the window does not depend on its
/// size.
void average(MapWindow& window, const std::vector<std::size_t>& gaps) {
  const auto columns = static_cast<std::size_t>(window.columns), rows = static_cast<std::size_t>(window.rows);
  std::vector<double> next(gaps.size());
  for (std::int32_t round = 0; round < kRounds; ++round) {
    const std::vector<double>& h = window.height_m;
    for (std::size_t g = 0; g < gaps.size(); ++g) {
      const std::size_t k = gaps[g], c = k % columns, r = k / columns;
      const double west = h[c > 0 ? k - 1 : k], east = h[c + 1 < columns ? k + 1 : k];
      const double north = h[r > 0 ? k - columns : k], south = h[r + 1 < rows ? k + columns : k];
      next[g] = ((west + east) + (north + south)) / 4;
    }
    for (std::size_t g = 0; g < gaps.size(); ++g) window.height_m[gaps[g]] = next[g];
  }
}

/// Gaps get the coarser heights, joined to the data beside them.
void fill_from(const MapWindow& coarse, MapWindow& window) {
  std::vector<std::size_t> gaps;
  for (std::size_t k = 0; k < window.height_m.size(); ++k) {
    if (!std::isnan(window.height_m[k])) continue;
    const auto row = static_cast<std::int64_t>(k) / window.columns, column = static_cast<std::int64_t>(k) % window.columns;
    window.height_m[k] = interpolated(coarse, window.west + column, window.north + row);
    gaps.push_back(k);
  }
  average(window, gaps);
}

/// Means of what there is among the four pixels of each coarser one; outside the window there is nothing.
MapWindow means(const MapWindow& fine) {
  MapWindow coarse = coarser(fine);
  for (std::int64_t row = coarse.north; row < coarse.north + coarse.rows; ++row) {
    for (std::int64_t column = coarse.west; column < coarse.west + coarse.columns; ++column) {
      double sum = 0;
      int count = 0;
      for (int k = 0; k < 4; ++k) {
        const std::int64_t c = 2 * column + (k & 1), r = 2 * row + (k >> 1);
        if (c < fine.west || r < fine.north || c >= fine.west + fine.columns || r >= fine.north + fine.rows) continue;
        const double height_m = fine.at(c, r);
        if (std::isnan(height_m)) continue;
        sum += height_m;
        ++count;
      }
      coarse.height_m.push_back(count > 0 ? sum / count : std::nan(""));
    }
  }
  return coarse;
}

/// The whole window from its own data: coarser and coarser until nothing is missing, and back.
void fill_whole(MapWindow& window) {
  if (!has_gaps(window)) return;
  if (std::all_of(window.height_m.begin(), window.height_m.end(), [](double h) { return std::isnan(h); })) {
    std::fill(window.height_m.begin(), window.height_m.end(), 0);
    return;
  }
  MapWindow coarse = means(window);
  if (coarse.columns > kFewPixels || coarse.rows > kFewPixels) {
    fill_whole(coarse);
  } else {
    double sum = 0;
    std::size_t count = 0;
    for (const double h : coarse.height_m) {
      if (std::isnan(h)) continue;
      sum += h;
      ++count;
    }
    for (double& h : coarse.height_m) h = std::isnan(h) ? sum / static_cast<double>(count) : h;
  }
  fill_from(coarse, window);
}

/// Everything that cannot be reached from the window's sides without crossing data.
std::vector<bool> closed_outline(const MapWindow& window) {
  const auto columns = static_cast<std::size_t>(window.columns), count = window.height_m.size();
  std::vector<bool> hull(count, true);
  std::vector<std::size_t> front;
  const auto reach = [&](std::size_t k) {
    if (!hull[k] || !std::isnan(window.height_m[k])) return;
    hull[k] = false;
    front.push_back(k);
  };
  for (std::size_t c = 0; c < columns; ++c) reach(c), reach(count - 1 - c);
  for (std::size_t k = 0; k < count; k += columns) reach(k), reach(k + columns - 1);
  while (!front.empty()) {
    const std::size_t k = front.back(), c = k % columns;
    front.pop_back();
    if (c > 0) reach(k - 1);
    if (c + 1 < columns) reach(k + 1);
    if (k >= columns) reach(k - columns);
    if (k + columns < count) reach(k + columns);
  }
  return hull;
}

/// Pixels to the hull, along sides and diagonals: within 8 % of the straight way.
std::vector<double> distances(const std::vector<bool>& hull, std::size_t columns) {
  std::vector<double> far(hull.size(), 1e9);
  const std::size_t rows = hull.size() / columns;
  const auto pass = [&](std::size_t k, std::ptrdiff_t side) {
    if (hull[k]) far[k] = 0;
    const std::size_t c = k % columns, r = k / columns;
    const bool first = side < 0 ? c == 0 : c + 1 == columns, top = side < 0 ? r == 0 : r + 1 == rows;
    const bool last = side < 0 ? c + 1 == columns : c == 0;
    const auto from = [&](std::ptrdiff_t offset, double way) {
      far[k] = std::min(far[k], far[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) + offset)] + way);
    };
    const auto row = side * static_cast<std::ptrdiff_t>(columns);
    if (!first) from(side, 1);
    if (!top) from(row, 1);
    if (!top && !first) from(row + side, std::numbers::sqrt2);
    if (!top && !last) from(row - side, std::numbers::sqrt2);
  };
  for (std::size_t k = 0; k < hull.size(); ++k) pass(k, -1);
  for (std::size_t k = hull.size(); k-- > 0;) pass(k, 1);
  return far;
}

/// How far outside the geoid is reached, pixels.
double fade_pixels(const MapWindow& window, double latitude_deg, double least) {
  double highest_m = 0;
  for (const double h : window.height_m) highest_m = std::isnan(h) ? highest_m : std::max(highest_m, std::abs(h));
  const double around_m = 2 * std::numbers::pi * proto::kSemiMajor_m * std::cos(latitude_deg * std::numbers::pi / 180);
  const double pixel_m = around_m / std::ldexp(kTilePixels, window.zoom);
  return std::clamp(std::ceil(highest_m / pixel_m), least, double{OutlineFill::kMostFade});
}

/// 1 at the outline, 0 where the geoid is reached, level at both.
double fade(double far, double whole) {
  const double left = 1 - std::min(far / whole, 1.0);
  return left * left * (3 - 2 * left);
}

/// Fills a window, all of it: inside the hull from what lies around, outside of it fading.
void fill_and_fade(const std::vector<bool>& hull, double whole, MapWindow& window) {
  const std::vector<double> far = distances(hull, static_cast<std::size_t>(window.columns));
  fill_whole(window);
  for (std::size_t k = 0; k < far.size(); ++k) window.height_m[k] *= fade(far[k], whole);
}

/// The same with so many pixels more on each side, without heights.
MapWindow widened(const MapWindow& window, std::int32_t by) {
  MapWindow wide = grown(window, by);
  wide.height_m.assign(static_cast<std::size_t>(wide.columns) * static_cast<std::size_t>(wide.rows), std::nan(""));
  for (std::int64_t row = window.north; row < window.north + window.rows; ++row) {
    for (std::int64_t column = window.west; column < window.west + window.columns; ++column)
      wide.height_m[wide.index(column, row)] = window.at(column, row);
  }
  return wide;
}

/// Whether is(column, row) holds of a pixel of the window that lies under a tile, or beside it.
template <class Is>
bool any_under(const MapWindow& window, const Place& tile, const Is& is) {
  const double scale = std::ldexp(1, window.zoom - tile.z);
  const auto first = [&](std::int64_t pixel) {
    return static_cast<std::int64_t>(std::floor(static_cast<double>(pixel) * scale)) - 2;
  };
  const auto last = [&](std::int64_t pixel) {
    return static_cast<std::int64_t>(std::ceil(static_cast<double>(pixel) * scale)) + 2;
  };
  const std::int64_t north = std::int64_t{kTilePixels} * tile.y, around = std::int64_t{kTilePixels} << tile.z;
  const std::int64_t south_end = std::min(last(north + kTilePixels), window.north + window.rows);
  for (const std::int64_t turn : {-around, std::int64_t{0}, around}) {  // a wide tile may lie on both sides of the data
    const std::int64_t west = std::int64_t{kTilePixels} * tile.x + turn;
    const std::int64_t east_end = std::min(last(west + kTilePixels), window.west + window.columns);
    for (std::int64_t r = std::max(first(north), window.north); r < south_end; ++r) {
      for (std::int64_t c = std::max(first(west), window.west); c < east_end; ++c) {
        if (is(c, r)) return true;
      }
    }
  }
  return false;
}

MapWindow overview_of(const raster::Area& extent, const Zooms& zooms, const proto::Manifest& manifest) {
  const auto span = [&](int zoom) {
    return std::max(longitude_pixel(zoom, extent.east_deg) - longitude_pixel(zoom, extent.west_deg),
                    latitude_pixel(zoom, extent.south_deg) - latitude_pixel(zoom, extent.north_deg));
  };
  int zoom = 0;
  while (zoom < zooms.last && span(zoom + 1) <= OutlineFill::kOverviewPixels) ++zoom;
  MapWindow window{zoom, level_of(manifest, zooms, zoom, raster::middle_latitude_deg(extent)), 0, 0, 0, 0, {}};
  window.west = static_cast<std::int64_t>(std::floor(longitude_pixel(zoom, extent.west_deg)));
  window.north = static_cast<std::int64_t>(std::floor(latitude_pixel(zoom, extent.north_deg)));
  window.columns =
      static_cast<std::int32_t>(std::ceil(longitude_pixel(zoom, extent.east_deg)) - static_cast<double>(window.west));
  window.rows = static_cast<std::int32_t>(std::ceil(latitude_pixel(zoom, extent.south_deg)) - static_cast<double>(window.north));
  return grown(window, OutlineFill::kMostFade + 2);
}

}  // namespace

proto::Result<OutlineFill> OutlineFill::of(const Terrain& terrain) {
  const auto extent = extent_of(terrain.manifest());
  if (!extent)
    return proto::Problem{
        "tile-unknown", "all of the dataset lies beyond 85.05 degrees of latitude, where Web Mercator ends", {}, {}};
  MapWindow overview = overview_of(*extent, zooms_of(terrain.manifest(), *extent), terrain.manifest());
  if (const auto drawn = draw_shown_heights(terrain, overview); !drawn) return drawn.problem();
  OutlineFill made;
  made.hull_ = closed_outline(overview);
  const double latitude_deg = raster::middle_latitude_deg(*extent);
  MapWindow data = means(overview);
  double least = kLeastFade;
  fill_and_fade(made.hull_, fade_pixels(overview, latitude_deg, least), overview);
  made.filled_.push_back(std::move(overview));
  while (made.filled_.back().zoom > 0) {
    MapWindow coarse = widened(data, kMostFade);
    data = means(data);
    least = std::max(least / 2, 1.0);
    fill_and_fade(closed_outline(coarse), fade_pixels(coarse, latitude_deg, least), coarse);
    made.filled_.push_back(std::move(coarse));
  }
  return made;
}

proto::Result<void> OutlineFill::fill(const Terrain& terrain, MapWindow& window) const {
  if (!has_gaps(window)) return {};
  const bool coarse_enough = window.zoom <= filled_.front().zoom;
  MapWindow wide = coarse_enough ? MapWindow() : grown(window, kRounds);
  if (!coarse_enough) {
    const auto extent = extent_of(terrain.manifest());
    MapWindow coarse = coarser(wide);
    coarse.level =
        level_of(terrain.manifest(), zooms_of(terrain.manifest(), *extent), coarse.zoom, raster::middle_latitude_deg(*extent));
    if (const auto drawn = draw_shown_heights(terrain, coarse); !drawn) return drawn.problem();
    if (const auto done = fill(terrain, coarse); !done) return done.problem();
    if (const auto drawn = draw_shown_heights(terrain, wide); !drawn) return drawn.problem();
    fill_from(coarse, wide);
  }
  for (std::size_t k = 0; k < window.height_m.size(); ++k) {
    if (!std::isnan(window.height_m[k])) continue;
    const std::int64_t row = window.north + static_cast<std::int64_t>(k) / window.columns,
                       column = window.west + static_cast<std::int64_t>(k) % window.columns;
    window.height_m[k] = coarse_enough ? height_m(window.zoom, column, row) : wide.at(column, row);
  }
  return {};
}

/// The column, some turns on, that is nearest to the overview's middle.
std::int64_t OutlineFill::turned(int zoom, std::int64_t column) const {
  const MapWindow& overview = filled_.front();
  const double around = std::ldexp(kTilePixels, zoom);
  const double middle = std::ldexp(static_cast<double>(overview.west) + overview.columns / 2.0, zoom - overview.zoom);
  const double turns = std::round((middle - static_cast<double>(column)) / around);
  return column + static_cast<std::int64_t>(turns * around);
}

double OutlineFill::height_m(int zoom, std::int64_t column, std::int64_t row) const {
  const MapWindow& window = filled_[static_cast<std::size_t>(filled_.front().zoom - zoom)];
  const std::int64_t c = turned(zoom, column);
  const bool within =
      c >= window.west && row >= window.north && c < window.west + window.columns && row < window.north + window.rows;
  if (!within) return 0;
  const double height_m = window.at(c, row);
  return std::isnan(height_m) ? 0 : height_m;
}

bool OutlineFill::hull(std::int64_t column, std::int64_t row) const {
  const MapWindow& overview = filled_.front();
  if (column < overview.west || row < overview.north) return false;
  if (column >= overview.west + overview.columns || row >= overview.north + overview.rows) return false;
  return hull_[overview.index(column, row)];
}

bool OutlineFill::inside(int zoom, std::int64_t column, std::int64_t row) const {
  const int finer = zoom - filled_.front().zoom;
  const auto to_overview = [&](std::int64_t pixel) { return finer >= 0 ? pixel >> finer : (2 * pixel + 1) << -finer >> 1; };
  const std::int64_t c = to_overview(turned(zoom, column)), r = to_overview(row);
  for (std::int64_t k = 0; k < 9; ++k) {
    if (!hull(c - 1 + k % 3, r - 1 + k / 3)) return false;
  }
  return true;
}

bool OutlineFill::holes_in(const MapWindow& window) const {
  for (std::size_t k = 0; k < window.height_m.size(); ++k) {
    const auto row = static_cast<std::int64_t>(k) / window.columns, column = static_cast<std::int64_t>(k) % window.columns;
    if (std::isnan(window.height_m[k]) && inside(window.zoom, window.west + column, window.north + row)) return true;
  }
  return false;
}

bool OutlineFill::reaches(int zoom, std::int32_t x, std::int32_t y, bool faded) const {
  const MapWindow& overview = filled_.front();
  if (any_under(overview, {0, zoom, x, y}, [&](std::int64_t c, std::int64_t r) { return hull(c, r); })) return true;
  const MapWindow& window = filled_[static_cast<std::size_t>(std::max(overview.zoom - zoom, 0))];
  return faded && any_under(window, {0, zoom, x, y}, [&](std::int64_t c, std::int64_t r) { return window.at(c, r) != 0; });
}

std::size_t OutlineFill::bytes() const {
  std::size_t bytes = sizeof(*this) + hull_.size() / 8;
  for (const MapWindow& window : filled_) bytes += sizeof(window) + window.height_m.size() * sizeof(double);
  return bytes;
}

}  // namespace cordillera::pipeline::faces
