#include "raster/pixels/pixels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proto/integers.h"
#include "proto/mesh.h"
#include "proto/wide.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();

constexpr std::size_t kOwnBytes = 2 << 20;  // samples and pixels of a place are asked for one after the other

/// In place: raw values -> metres.
CORDILLERA_WIDE void to_heights(double factor, double offset_m, const Validity& valid, double* __restrict line,
                                std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    const double height_m = factor * line[i] + offset_m;
    line[i] = valid(line[i]) & (std::abs(height_m) <= proto::kMaxHeight_m) ? height_m : kVoid;
  }
}

}  // namespace

Pixels::Pixels(const Dataset& dataset, const HeightRule& rule, int period)
    : dataset_(dataset), rule_(rule), period_(period), validity_(dataset), lately_(std::make_shared<SharedPixels>(kOwnBytes)) {}

proto::Result<void> Pixels::read(const PixelWindow& window, std::vector<double>& heights) {
  if (!lately_->read(raster_, window, heights)) {
    if (auto done = read_anew(window, heights); !done.ok()) return done;
    lately_->keep(raster_, window, heights);  // voids as such: others may want them so
  }
  if (rule_.voids == VoidRule::value) put_height(window, heights);
  return {};
}

/// Where the raster has a pixel, and that has no data.
void Pixels::put_height(const PixelWindow& window, std::vector<double>& heights) const {
  const std::int64_t first = std::max<std::int64_t>(window.y, 0),
                     last = std::min<std::int64_t>(window.y + window.rows, dataset_.rows);
  for (std::int64_t y = first; y < last; ++y) {
    double* const line = heights.data() + static_cast<std::size_t>(y - window.y) * window.columns;
    for (int c = 0; c < window.columns; ++c) {
      const std::int64_t column = period_ != 0 ? proto::modulo(window.x + c, period_) : window.x + c;
      if (std::isnan(line[c]) && column >= 0 && column < dataset_.columns) line[c] = rule_.void_height_m;
    }
  }
}

proto::Result<void> Pixels::read_anew(const PixelWindow& window, std::vector<double>& heights) {
  heights.resize(window.count());
  const bool inside =
      window.x >= 0 && window.y >= 0 && window.x + window.columns <= dataset_.columns && window.y + window.rows <= dataset_.rows;
  if (!inside || period_ != 0 || dataset_.is_sparse()) std::fill(heights.begin(), heights.end(), kVoid);
  if (period_ == 0) return read_inside(window, window, 0, heights);
  // Columns 0 .. period-1 repeat around the earth; a duplicated last column of a grid-registered raster is never read.
  const std::int64_t first = proto::floor_divide(window.x, period_),
                     last = proto::floor_divide(window.x + window.columns - 1, period_);
  for (std::int64_t turn = first; turn <= last; ++turn) {
    const std::int64_t west = std::max(window.x, turn * period_),
                       east = std::min(window.x + window.columns, (turn + 1) * period_);
    const PixelWindow part{west - turn * period_, window.y, static_cast<int>(east - west), window.rows};
    if (auto done = read_inside(part, window, turn * period_, heights); !done.ok()) return done;
  }
  return {};
}

/// Reads what of part lies in the raster into its place in window; part.x + shift is the column in the window's own count.
proto::Result<void> Pixels::read_inside(const PixelWindow& part, const PixelWindow& window, std::int64_t shift,
                                        std::vector<double>& heights) {
  const std::int64_t x0 = std::max<std::int64_t>(part.x, 0), x1 = std::min<std::int64_t>(part.x + part.columns, dataset_.columns);
  const std::int64_t y0 = std::max<std::int64_t>(part.y, 0), y1 = std::min<std::int64_t>(part.y + part.rows, dataset_.rows);
  if (x0 >= x1 || y0 >= y1) return {};
  const auto place = [&](std::int64_t x, std::int64_t y) {
    return heights.data() + static_cast<std::size_t>(y - window.y) * window.columns +
           static_cast<std::size_t>(x + shift - window.x);
  };
  const std::size_t stride = static_cast<std::size_t>(window.columns);
  const auto fill = [&](std::int64_t y, std::int64_t west, std::int64_t east) {
    std::fill_n(place(west, y), east - west, kVoid);
  };
  if (dataset_.missing.empty()) {
    const Coverage::Rectangle inside{x0, y0, x1, y1};
    if (dataset_.covered == nullptr || dataset_.covered->touches(inside)) {
      const PixelWindow stored{x0, y0, static_cast<int>(x1 - x0), static_cast<int>(y1 - y0)};
      if (auto done = read_stored(stored, place(x0, y0), stride); !done.ok()) return done;
    }
    if (dataset_.covered != nullptr) dataset_.covered->each_gap(inside, fill);
    return {};
  }
  const int bw = dataset_.block_columns, bh = dataset_.block_rows;
  for (std::int64_t by = y0 / bh; by * bh < y1; ++by) {
    for (std::int64_t bx = x0 / bw; bx * bw < x1; ++bx) {
      const std::int64_t west = std::max(x0, bx * bw), east = std::min(x1, (bx + 1) * bw);
      const std::int64_t top = std::max(y0, by * bh), bottom = std::min(y1, (by + 1) * bh);
      if (block_missing(bx, by)) continue;
      const PixelWindow block{west, top, static_cast<int>(east - west), static_cast<int>(bottom - top)};
      if (auto done = read_stored(block, place(west, top), stride); !done.ok()) return done;
    }
  }
  return {};
}

proto::Result<void> Pixels::read_stored(const PixelWindow& part, double* out, std::size_t stride) {
  const auto band = text_.band(dataset_, static_cast<int>(part.y) + part.rows);
  if (!band.ok()) return band.problem();
  const GdalScope scope(dataset_.trust);
  const int x = static_cast<int>(part.x), y = static_cast<int>(part.y);
  const GSpacing line_bytes = static_cast<GSpacing>(stride * sizeof(double));
  CPLErr error = (*band)->RasterIO(GF_Read, x, y, part.columns, part.rows, out, part.columns, part.rows, GDT_Float64,
                                   sizeof(double), line_bytes, nullptr);
  if (error == CE_None && dataset_.mask != nullptr) {
    mask_.resize(static_cast<std::size_t>(part.columns) * part.rows);
    error = dataset_.mask->RasterIO(GF_Read, x, y, part.columns, part.rows, mask_.data(), part.columns, part.rows, GDT_Byte, 1,
                                    part.columns, nullptr);
  }
  if (error != CE_None || scope.failed()) return unreadable_pixels(dataset_, scope);
  for (int r = 0; r < part.rows; ++r) {
    const std::uint8_t* mask = dataset_.mask == nullptr ? nullptr : mask_.data() + static_cast<std::size_t>(r) * part.columns;
    to_metres(out + static_cast<std::size_t>(r) * stride, mask, static_cast<std::size_t>(part.columns));
  }
  return {};
}

void Pixels::to_metres(double* line, const std::uint8_t* mask, std::size_t count) const {
  for (std::size_t i = 0; dataset_.signed_byte && i < count; ++i)
    if (line[i] > 127) line[i] -= 256;
  to_heights(rule_.scale, rule_.offset_m, validity_, line, count);
  for (std::size_t i = 0; mask != nullptr && i < count; ++i)
    if (mask[i] == 0) line[i] = kVoid;
}

bool Pixels::block_missing(std::int64_t block_x, std::int64_t block_y) const {
  return dataset_.missing[static_cast<std::size_t>(block_y * dataset_.blocks_across + block_x)];
}

bool Pixels::certainly_void(const PixelWindow& window) const {
  if (rule_.voids != VoidRule::hole) return false;
  const std::int64_t x0 = std::max<std::int64_t>(window.x, 0),
                     x1 = std::min<std::int64_t>(window.x + window.columns, dataset_.columns);
  const std::int64_t y0 = std::max<std::int64_t>(window.y, 0), y1 = std::min<std::int64_t>(window.y + window.rows, dataset_.rows);
  if (period_ != 0 && (window.x < 0 || window.x + window.columns > dataset_.columns)) return false;
  if (x0 >= x1 || y0 >= y1) return true;
  if (dataset_.covered != nullptr) return !dataset_.covered->touches({x0, y0, x1, y1});
  if (dataset_.missing.empty()) return false;
  for (std::int64_t by = y0 / dataset_.block_rows; by * dataset_.block_rows < y1; ++by)
    for (std::int64_t bx = x0 / dataset_.block_columns; bx * dataset_.block_columns < x1; ++bx)
      if (!block_missing(bx, by)) return false;
  return true;
}

}  // namespace cordillera::raster
