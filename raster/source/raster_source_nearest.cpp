// Source::nearest: what the pixel that holds a place says, read in windows of bounded size.
#include <algorithm>
#include <cmath>
#include <limits>

#include "raster/source/raster_source.h"

namespace cordillera::raster {
namespace {

constexpr std::int64_t kNowhere = std::numeric_limits<std::int64_t>::min();
// A place on the edge of two pixels, to within the rounding of a projection, belongs to the eastern and the southern one.
constexpr double kEdge_px = 1e-6;

/// The pixel of a coordinate whose whole numbers are edges.
std::int64_t pixel_at(double at, int count, int period) {
  if (!std::isfinite(at)) return kNowhere;
  if (period != 0) at -= period * std::floor((at + kEdge_px) / period);
  const double pixel = std::floor(at + kEdge_px);
  if (period == 0 && pixel == count && at <= count + kEdge_px) return count - 1;  // the raster's own far edge
  return pixel >= 0 && pixel < count ? static_cast<std::int64_t>(pixel) : kNowhere;
}

}  // namespace

proto::Result<void> Source::nearest(std::span<const double> longitude_deg, std::span<const double>, double* out) {
  std::fill_n(out, longitude_deg.size(), std::numeric_limits<double>::quiet_NaN());
  return {};
}

proto::Result<void> RasterSource::nearest(std::span<const double> longitude_deg, std::span<const double> latitude_deg,
                                          double* out) {
  std::vector<double> x(longitude_deg.begin(), longitude_deg.end()), y(latitude_deg.begin(), latitude_deg.end());
  parts_.placement->to_pixels(x.data(), y.data(), x.size());
  std::vector<PixelPlace> places;
  places.reserve(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::int64_t column = pixel_at(x[k], parts_.dataset.columns, parts_.placement->period_px()),
                       row = pixel_at(y[k], parts_.dataset.rows, 0);
    places.push_back(column == kNowhere || row == kNowhere ? PixelPlace{kNowhere, kNowhere} : PixelPlace{column, row});
  }
  return read_nearest(places, out);
}

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
