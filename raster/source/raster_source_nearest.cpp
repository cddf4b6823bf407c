// Source::nearest: what the pixel that holds a place says, read in windows of bounded size.
#include <algorithm>
#include <cmath>
#include <limits>

#include "raster/place/lattice_places.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {
namespace {

constexpr std::int64_t kNowhere = std::numeric_limits<std::int64_t>::min();
// A place on the edge of two pixels, to within the rounding of a projection, belongs to the eastern and the southern one.
constexpr double kEdge_px = 1e-6;

/// The pixel of a coordinate whose whole numbers are edges.
std::int64_t pixel_at(double at, int count, int period) {
  if (period != 0) at -= period * std::floor((at + kEdge_px) / period);
  const double beyond = at + kEdge_px;
  if (!(beyond >= 0)) return kNowhere;
  if (beyond < count) return static_cast<std::int64_t>(beyond);
  return period == 0 && at <= count + kEdge_px ? count - 1 : kNowhere;  // the raster's own far edge
}

}  // namespace

RasterSource::PixelPlace RasterSource::place_of(std::int64_t column, std::int64_t row) {
  return column == kNowhere || row == kNowhere ? PixelPlace{kNowhere, kNowhere} : PixelPlace{column, row};
}

proto::Result<void> Source::nearest(std::span<const double> longitude_deg, std::span<const double>, double* out) {
  std::fill_n(out, longitude_deg.size(), std::numeric_limits<double>::quiet_NaN());
  return {};
}

proto::Result<void> Source::nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out) {
  std::vector<double> longitude_deg, latitude_deg;
  for (std::int64_t j = cells.south; j < cells.north; ++j) {
    for (std::int64_t i = cells.west; i < cells.east; ++i) {
      longitude_deg.push_back(lattice.longitude_at_deg(static_cast<double>(i) + 0.5));
      latitude_deg.push_back(lattice.latitude_deg(j) + lattice.cell_deg() / 2);
    }
  }
  return nearest(longitude_deg, latitude_deg, out);
}

proto::Result<void> RasterSource::nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg,
                                          double* out) {
  std::vector<double> x(longitude_deg.begin(), longitude_deg.end()), y(latitude_deg.begin(), latitude_deg.end());
  parts_.placement->to_pixels(x.data(), y.data(), x.size());
  std::vector<PixelPlace> places;
  places.reserve(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) places.push_back(place_of(pixel_column(x[k]), pixel_row(y[k])));
  return read_nearest(places, out);
}

proto::Result<void> RasterSource::nearest_in_cells(const proto::Lattice& lattice, const Window& cells, double* out) {
  if (cells.west >= cells.east || cells.south >= cells.north) return {};
  const proto::Lattice halves{lattice.finest_level + 1};  // every second vertex of a lattice twice as fine is a middle
  const auto wide = static_cast<std::size_t>(cells.east - cells.west);
  std::vector<double> x(2 * wide - 1), y(x.size());
  LatticePlaces middles(*parts_.placement, halves, 2 * cells.west + 1, static_cast<std::int32_t>(x.size()), vertex_patches_);
  std::vector<PixelPlace> places;
  places.reserve(wide * static_cast<std::size_t>(cells.north - cells.south));
  std::vector<std::int64_t> columns(wide), rows(wide);
  for (std::int64_t j = cells.south; j < cells.north; ++j) {
    middles.row(2 * j + 1, x.data(), y.data());
    const bool straight = parts_.placement->straight_plate();
    for (std::size_t c = 0; c < wide && (!straight || j == cells.south); ++c) columns[c] = pixel_column(x[2 * c]);
    rows[0] = pixel_row(y[0]);
    for (std::size_t c = 1; c < wide; ++c) rows[c] = straight ? rows[0] : pixel_row(y[2 * c]);
    for (std::size_t c = 0; c < wide; ++c) places.push_back(place_of(columns[c], rows[c]));
  }
  return read_nearest(places, out);
}

std::int64_t RasterSource::pixel_column(double x) const {
  return pixel_at(x, parts_.dataset.columns, parts_.placement->period_px());
}
std::int64_t RasterSource::pixel_row(double y) const { return pixel_at(y, parts_.dataset.rows, 0); }

proto::Result<void> RasterSource::read_nearest(std::span<const PixelPlace> places, double* out) {
  std::fill_n(out, places.size(), std::numeric_limits<double>::quiet_NaN());
  PixelPlace low{std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::max()}, high{-1, -1};
  for (const PixelPlace& p : places) {
    if (p.x == kNowhere) continue;
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  if (high.x < 0) return {};
  if ((high.x - low.x + 1) * (high.y - low.y + 1) >
      kMaxBlockPixels) {  // far finer than what is asked for, or on both ends of a raster
    const std::size_t half = places.size() / 2;
    if (auto first = read_nearest(places.first(half), out); !first.ok()) return first.problem();
    return read_nearest(places.subspan(half), out + half);
  }
  block_.window = {low.x, low.y, static_cast<int>(high.x - low.x + 1), static_cast<int>(high.y - low.y + 1)};
  if (auto done = pixels_.read(block_.window, block_.heights); !done.ok()) return done.problem();
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k].x != kNowhere) out[k] = block_.at(places[k].x, places[k].y);
  }
  return {};
}

}  // namespace cordillera::raster
