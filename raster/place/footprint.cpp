#include "raster/place/footprint.h"

#include <GeographicLib/Geodesic.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace cordillera::raster {
namespace {

constexpr int kGrid = 64;       ///< cells a side of the grid thrown over the whole raster
constexpr int kBoundary = 512;  ///< segments a side of its boundary

struct Points {
  std::vector<double> lon, lat;
  bool lost = false;                  ///< some had no image
  double lon_step = 0, lat_step = 0;  ///< largest difference between neighbours
};

void add_line(Points& points, const Placement& placement, std::vector<double> x, std::vector<double> y) {
  placement.to_degrees(x.data(), y.data(), x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k]) || !std::isfinite(y[k])) {
      points.lost = true;
      continue;
    }
    points.lon.push_back(x[k]);
    points.lat.push_back(std::clamp(y[k], -90.0, 90.0));
    if (k == 0 || !std::isfinite(x[k - 1])) continue;
    points.lon_step = std::max(points.lon_step, std::abs(std::remainder(x[k] - x[k - 1], 360.0)));
    points.lat_step = std::max(points.lat_step, std::abs(y[k] - y[k - 1]));
  }
}

/// Points along a line from (x0, y0) to (x1, y1) in pixel coordinates.
void add_segment(Points& points, const Placement& placement, const PixelExtent& line, int segments) {
  std::vector<double> x, y;
  for (int k = 0; k <= segments; ++k) {
    const double t = static_cast<double>(k) / segments;
    x.push_back(line.west + t * (line.east - line.west));
    y.push_back(line.north + t * (line.south - line.north));
  }
  add_line(points, placement, std::move(x), std::move(y));
}

void add_boundary(Points& points, const Placement& placement, const PixelExtent& e) {
  add_segment(points, placement, {e.west, e.north, e.east, e.north}, kBoundary);
  add_segment(points, placement, {e.west, e.south, e.east, e.south}, kBoundary);
  add_segment(points, placement, {e.west, e.north, e.west, e.south}, kBoundary);
  add_segment(points, placement, {e.east, e.north, e.east, e.south}, kBoundary);
}

bool holds_pole(const Placement& placement, const PixelExtent& e, double latitude_deg) {
  double x = 0, y = latitude_deg;
  placement.to_pixels(&x, &y, 1);
  return x >= e.west && x <= e.east && y >= e.north && y <= e.south;
}

/// West and east around all longitudes: the complement of the widest gap. True when no gap is wide enough to be one.
bool span_longitudes(std::vector<double> lon, double step, double& west, double& east) {
  for (double& l : lon) l -= 360 * std::floor((l + 180) / 360);
  std::sort(lon.begin(), lon.end());
  double widest = lon.front() + 360 - lon.back();
  west = lon.front();
  east = lon.back();
  for (std::size_t k = 1; k < lon.size(); ++k) {
    if (lon[k] - lon[k - 1] <= widest) continue;
    widest = lon[k] - lon[k - 1];
    west = lon[k];
    east = lon[k - 1] + 360;
  }
  return widest <= 2 * step;
}

/// Longitude is the column and latitude the row: exact, and longitudes keep the turn the file gives them.
Footprint plate_footprint(const Placement& placement, const PixelExtent& e) {
  double lon[4] = {e.west, e.east, e.east, e.west}, lat[4] = {e.north, e.north, e.south, e.south};
  placement.to_degrees(lon, lat, 4);
  const auto [west, east] = std::minmax_element(lon, lon + 4);
  const auto [south, north] = std::minmax_element(lat, lat + 4);
  Footprint f;
  f.full_circle = placement.period_px() != 0 || *east - *west >= 360;
  const double turn = 360 * std::floor((*west + 180) / 360);
  f.tight = {*west - turn, std::max(-90.0, *south), *east - turn, std::min(90.0, *north)};
  f.safe = f.tight;
  return f;
}

}  // namespace

Footprint footprint(const Placement& placement, const PixelExtent& extent) {
  Footprint f;
  if (placement.plate()) {
    f = plate_footprint(placement, extent);
  } else {
    Points edge;
    add_boundary(edge, placement, extent);
    Points all = edge;
    for (int k = 1; k < kGrid; ++k) {
      const double y = extent.north + (extent.south - extent.north) * k / kGrid;
      add_segment(all, placement, {extent.west, y, extent.east, y}, kGrid);
    }
    if (all.lon.empty()) return f;
    // Where the whole edge has an image, nothing lies beyond it; else between two points of the coarse grid anything may.
    const double lon_step = edge.lost ? all.lon_step : edge.lon_step, lat_step = edge.lost ? 2 * all.lat_step : edge.lat_step;
    const auto [south, north] = std::minmax_element(all.lat.begin(), all.lat.end());
    f.tight.south_deg = *south;
    f.tight.north_deg = *north;
    f.full_circle = span_longitudes(all.lon, all.lon_step, f.tight.west_deg, f.tight.east_deg) || placement.period_px() != 0;
    f.safe = {f.tight.west_deg - lon_step, std::max(-90.0, *south - lat_step), f.tight.east_deg + lon_step,
              std::min(90.0, *north + lat_step)};
    for (const double pole : {-90.0, 90.0}) {
      if (!holds_pole(placement, extent, pole)) continue;
      f.full_circle = true;
      (pole < 0 ? f.tight.south_deg : f.tight.north_deg) = pole;
      (pole < 0 ? f.safe.south_deg : f.safe.north_deg) = pole;
    }
    if (f.safe.east_deg - f.safe.west_deg >= 360) f.full_circle = true;
  }
  if (f.full_circle) {
    f.tight.west_deg = f.safe.west_deg = -180;
    f.tight.east_deg = f.safe.east_deg = 180;
  }
  return f;
}

GroundSize ground_size(const Placement& placement, double c, double r) {
  double lon[4] = {c, c + 1, c + 0.5, c + 0.5}, lat[4] = {r + 0.5, r + 0.5, r, r + 1};
  placement.to_degrees(lon, lat, 4);
  GroundSize size;
  for (const double v : lat)
    if (!std::isfinite(v)) return size;
  for (double& v : lat) v = std::clamp(v, -90.0, 90.0);
  const GeographicLib::Geodesic& earth = GeographicLib::Geodesic::WGS84();
  earth.Inverse(lat[0], lon[0], lat[1], lon[1], size.width_m);
  earth.Inverse(lat[2], lon[2], lat[3], lon[3], size.height_m);
  return size;
}

CellSpan cell_span(const Placement& placement, int columns, int rows, const proto::Lattice& lattice) {
  constexpr double kDelta_deg = 1e-5;
  std::vector<double> spans_x, spans_y;
  for (int k = 0; k < 9; ++k) {
    double lon = columns * (1 + k % 3) / 4.0, lat = rows * (1 + k / 3) / 4.0;
    placement.to_degrees(&lon, &lat, 1);
    lat = std::clamp(lat, -89.9, 89.9);
    double x[4] = {lon - kDelta_deg, lon + kDelta_deg, lon, lon}, y[4] = {lat, lat, lat - kDelta_deg, lat + kDelta_deg};
    placement.to_pixels(x, y, 4);
    const double cells = lattice.cell_deg() / (2 * kDelta_deg);
    const double span_x = cells * std::hypot(x[1] - x[0], x[3] - x[2]), span_y = cells * std::hypot(y[1] - y[0], y[3] - y[2]);
    if (std::isfinite(span_x) && std::isfinite(span_y)) spans_x.push_back(span_x), spans_y.push_back(span_y);
  }
  if (spans_x.empty()) return {};
  std::sort(spans_x.begin(), spans_x.end());
  std::sort(spans_y.begin(), spans_y.end());
  return {spans_x[spans_x.size() / 2], spans_y[spans_y.size() / 2]};
}

}  // namespace cordillera::raster
