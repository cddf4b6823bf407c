#include "raster/resampling_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "raster/gdal_scope.h"
#include "raster/raster_source.h"

namespace cordillera::raster {
namespace {

std::int64_t up_to_blocks(std::int64_t length, std::int64_t block) { return (length + block - 1) / block * block; }

/// One axis of a net: count positions of [first, first + size), in `groups` chunks of it.
struct Axis {
  std::int64_t first, size, chunk;  ///< chunks start at multiples of chunk, like blocks
  std::int64_t count, groups;

  std::int64_t first_chunk() const { return first / chunk; }
  std::int64_t chunks() const { return (first + size - 1) / chunk - first_chunk() + 1; }

  void spread(std::int64_t begin, std::int64_t length, std::int64_t n, std::vector<std::int64_t>& out) const {
    n = std::min(n, length);
    for (std::int64_t k = 0; k < n; ++k) {
      const std::int64_t low = begin + k * length / n, high = begin + (k + 1) * length / n;
      // Multiples of the golden ratio: a fixed phase could fall on lattice vertices again and again, where the deviation is nil.
      const std::int64_t phase = (static_cast<std::int64_t>(out.size()) * 40503 + 32768) & 0xffff;
      out.push_back(low + (((high - low) * phase) >> 16));
    }
  }

  std::vector<std::int64_t> positions() const {
    std::vector<std::int64_t> out;
    if (groups >= std::min(chunks(), count)) {
      spread(first, size, count, out);
      return out;
    }
    for (std::int64_t g = 0; g < groups; ++g) {
      const std::int64_t at = first_chunk() + (2 * g + 1) * chunks() / (2 * groups);
      const std::int64_t low = std::max(first, at * chunk), high = std::min(first + size, (at + 1) * chunk);
      spread(low, high - low, (g + 1) * count / groups - g * count / groups, out);
    }
    return out;
  }
};

}  // namespace

PixelNet spread_net(const NetFrame& f) {
  if (f.columns < 1 || f.rows < 1) return {};
  const std::int64_t windows = kNetCost_px / std::max<std::int64_t>(1, f.window_columns) / std::max<std::int64_t>(1, f.window_rows);
  const std::int64_t count = std::clamp<std::int64_t>(windows, 1, kNetPixels);
  const double aspect = static_cast<double>(f.columns) / static_cast<double>(f.rows);
  std::int64_t across = std::llround(std::sqrt(static_cast<double>(count) * aspect));
  across = std::clamp<std::int64_t>(across, 1, std::min(f.columns, count));
  const std::int64_t up = std::min(f.rows, count / across);
  across = std::min(f.columns, count / up);
  Axis x{f.x, f.columns, up_to_blocks(f.window_columns, f.block_columns), across, across};
  Axis y{f.y, f.rows, up_to_blocks(f.window_rows, f.block_rows), up, up};
  x.groups = std::min(x.count, x.chunks());
  y.groups = std::min(y.count, y.chunks());
  while (x.groups * y.groups > 1 && x.groups * y.groups > kNetCost_px / x.chunk / y.chunk)
    (x.groups >= y.groups ? x.groups : y.groups) /= 2;
  return {x.positions(), y.positions()};
}

double cell_height_steps(const proto::Samples& cell, double fx, double fy) {
  const double sw = cell.height[0], se = cell.height[1], nw = cell.height[2], ne = cell.height[3];
  return fx >= fy ? sw + fx * (se - sw) + fy * (ne - se) : sw + fy * (nw - sw) + fx * (ne - nw);
}

/// The pixels that the lattice can have to do with: all, or those under the bbox where it has an image.
PixelWindow RasterSource::pixels_in_area() const {
  const PixelWindow all{0, 0, parts_.dataset.columns, parts_.dataset.rows};
  if (!parts_.options.bbox) return all;
  constexpr int kNet = 33;
  std::vector<double> x, y;
  const Area& a = parts_.area;
  for (int k = 0; k < kNet * kNet; ++k) {
    x.push_back(a.west_deg + (a.east_deg - a.west_deg) * (k % kNet) / (kNet - 1));
    y.push_back(a.south_deg + (a.north_deg - a.south_deg) * (k / kNet) / (kNet - 1));
  }
  parts_.placement->to_pixels(x.data(), y.data(), x.size());
  for (std::size_t k = 0; k < x.size(); ++k)
    if (!std::isfinite(x[k]) || !std::isfinite(y[k])) return all;
  const auto span = [](const std::vector<double>& v, int count) {
    const auto [low, high] = std::minmax_element(v.begin(), v.end());
    const double first = std::clamp(std::floor(*low), 0.0, count - 1.0), last = std::clamp(std::ceil(*high), first + 1, 0.0 + count);
    return std::pair<int, int>(static_cast<int>(first), static_cast<int>(last - first));
  };
  const auto [column, columns] = span(x, all.columns);
  const auto [row, rows] = span(y, all.rows);
  return {column, row, columns, rows};
}

/// NaN where there is nothing to compare: a void, no place on the earth, a void vertex around, a block that cannot be read.
double RasterSource::deviation_m(const proto::Lattice& lattice, std::int64_t column, std::int64_t row) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  if (!pixels_.read({column, row, 1, 1}, block_.heights).ok() || std::isnan(block_.heights[0])) return kNothing;
  double height_m = block_.heights[0];
  double longitude = static_cast<double>(column) + 0.5, latitude = static_cast<double>(row) + 0.5;
  parts_.placement->to_degrees(&longitude, &latitude, 1);
  if (!std::isfinite(longitude) || !(std::abs(latitude) <= 90)) return kNothing;
  height_m += undulation_m(latitude, longitude);
  const double x = (longitude + 180) * static_cast<double>(lattice.columns()) / 360;
  const double y = (latitude + 90) * static_cast<double>(lattice.rows()) / 180;
  const double west = std::floor(x), south = std::min(std::floor(y), static_cast<double>(lattice.rows() - 1));
  const auto cell = sample_present(lattice, std::llround(west), std::llround(south), 2, 2);
  if (!cell.ok() || std::count(cell->height.begin(), cell->height.end(), proto::kNoHeight) > 0) return kNothing;
  return std::abs(height_m - cell_height_steps(*cell, x - west, y - south) * proto::kHeightStep_m);
}

double RasterSource::resampling_error_m(const proto::Lattice& lattice) {
  const GdalScope scope(parts_.dataset.trust);
  const KernelFrame& frame = frame_for(lattice);
  const PixelWindow area = pixels_in_area();
  const PixelWindow window = Kernel(frame).around({0, 0}, {frame.ratio_x, frame.ratio_y});
  NetFrame net_frame{area.x, area.y, area.columns, area.rows, window.columns, window.rows, 1, 1};
  int block_columns = 1, block_rows = 1;
  parts_.dataset.band->GetBlockSize(&block_columns, &block_rows);
  net_frame.block_columns = std::clamp(block_columns, 1, parts_.dataset.columns);
  net_frame.block_rows = std::clamp(block_rows, 1, parts_.dataset.rows);
  const PixelNet net = spread_net(net_frame);
  double greatest_m = 0;
  for (const std::int64_t row : net.rows) {
    for (const std::int64_t column : net.columns) {
      const double here_m = deviation_m(lattice, column, row);
      if (here_m > greatest_m) greatest_m = here_m;
    }
  }
  return greatest_m;
}

}  // namespace cordillera::raster
