#include "raster/source/raster_source.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "raster/gdal/gdal_scope.h"
#include "raster/pixels/decimation.h"
#include "raster/place/lattice_places.h"
#include "raster/source/placed_row.h"

namespace cordillera::raster {
namespace {

/// Lattice vertices this close to the data's rim count as on it, in cells.
constexpr double kRim_cells = 1e-6;
}  // namespace

struct RasterSource::Call {
  const proto::Lattice& lattice;
  proto::Samples samples;
  Kernel kernel;

  std::size_t index(std::int32_t c, std::int32_t r) const { return static_cast<std::size_t>(r) * samples.columns + c; }
};

RasterSource::RasterSource(SourceParts parts)
    : parts_(std::move(parts)), pixels_(parts_.dataset, parts_.height_rule, parts_.placement->period_px()) {}

Source::Window RasterSource::window(const proto::Lattice& lattice) const {
  const Area& a = parts_.area;
  const double columns_a_degree = static_cast<double>(lattice.columns()) / 360,
               rows_a_degree = static_cast<double>(lattice.rows()) / 180;
  Window w;
  w.south = std::clamp<std::int64_t>(std::llround(std::ceil((a.south_deg + 90) * rows_a_degree - kRim_cells)), 0, lattice.rows());
  w.north = std::clamp<std::int64_t>(std::llround(std::floor((a.north_deg + 90) * rows_a_degree + kRim_cells)), w.south,
                                     lattice.rows());
  if (parts_.full_circle) {
    w.west = 0;
    w.east = lattice.columns();
    return w;
  }
  w.west = std::llround(std::ceil((a.west_deg + 180) * columns_a_degree - kRim_cells));
  w.east =
      std::max(w.west, static_cast<std::int64_t>(std::llround(std::floor((a.east_deg + 180) * columns_a_degree + kRim_cells))));
  const std::int64_t turn = w.west - modulo(w.west, lattice.columns());
  w.west -= turn;
  w.east = std::min(w.east - turn, w.west + lattice.columns());
  return w;
}

bool RasterSource::empty(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int64_t columns,
                         std::int64_t rows) const {
  const Window w = window(lattice);
  if (south > w.north || south + rows - 1 < w.south) return true;
  const std::int64_t gap = modulo(west - w.west, lattice.columns());  // from the window's west to ours, eastward
  if (gap > w.east - w.west && gap + columns - 1 < lattice.columns()) return true;
  if (!parts_.dataset.is_sparse()) return false;
  // Where the rectangle lies in the source, from a net of points; a torn net proves nothing.
  constexpr int kNet = 17;
  const GdalScope scope(parts_.dataset.trust);
  std::vector<double> x, y;
  for (int r = 0; r < kNet; ++r) {
    for (int c = 0; c < kNet; ++c) {
      x.push_back(lattice.longitude_deg(west) + lattice.cell_deg() * static_cast<double>(columns - 1) * c / (kNet - 1));
      y.push_back(std::clamp(lattice.latitude_deg(south) + lattice.cell_deg() * static_cast<double>(rows - 1) * r / (kNet - 1),
                             -90.0, 90.0));
    }
  }
  parts_.placement->to_pixels(x.data(), y.data(), x.size());
  double step = 0, low_x = x[0], high_x = x[0], low_y = y[0], high_y = y[0];
  for (int k = 0; k < kNet * kNet; ++k) {
    if (!std::isfinite(x[k])) return false;
    low_x = std::min(low_x, x[k]), high_x = std::max(high_x, x[k]), low_y = std::min(low_y, y[k]),
    high_y = std::max(high_y, y[k]);
    if (k % kNet > 0) step = std::max({step, std::abs(x[k] - x[k - 1]), std::abs(y[k] - y[k - 1])});
    if (k >= kNet) step = std::max({step, std::abs(x[k] - x[k - kNet]), std::abs(y[k] - y[k - kNet])});
  }
  const double size = std::max(high_x - low_x, high_y - low_y);
  if (step > size / 4 || size > 1e9) return false;
  const double margin = step + 3;
  const auto x0 = static_cast<std::int64_t>(std::floor(low_x - margin)),
             y0 = static_cast<std::int64_t>(std::floor(low_y - margin));
  return pixels_.certainly_void({x0, y0, static_cast<int>(std::ceil(high_x + margin) - static_cast<double>(x0)),
                                 static_cast<int>(std::ceil(high_y + margin) - static_cast<double>(y0))});
}

void RasterSource::set_beyond(Beyond beyond) {
  beyond_ = std::move(beyond);
  frame_.reset();
  if (!parts_.point || parts_.full_circle) return;
  // Up to the next points. There is data only where somebody has them, for a cell of points needs all of its corners.
  const Footprint wide = footprint(*parts_.placement, {-0.5, -0.5, parts_.dataset.columns + 0.5, parts_.dataset.rows + 0.5});
  if (wide.full_circle) return;
  const auto& box = parts_.options.bbox;
  parts_.area = box ? intersect(wide.safe, *box).value_or(parts_.area) : wide.safe;
}

const KernelFrame& RasterSource::frame_for(const proto::Lattice& lattice) {
  if (frame_ && frame_level_ == lattice.finest_level) return *frame_;
  const Dataset& d = parts_.dataset;
  KernelFrame frame{d.columns, d.rows, parts_.placement->period_px(), parts_.point, beyond_ != nullptr, 1, 1};
  const auto widened = [](double span_px) { return span_px > 1.001 ? std::min(span_px, 1e6) : 1.0; };
  const CellSpan span = cell_span(*parts_.placement, d.columns, d.rows, lattice);
  frame.ratio_x = widened(span.x_px);
  frame.ratio_y = widened(span.y_px);
  frame_ = frame;
  frame_level_ = lattice.finest_level;
  return *frame_;
}

void RasterSource::place_samples(Call& call) {
  const proto::Lattice& lattice = call.lattice;
  const Window w = window(lattice);
  const std::int32_t columns = call.samples.columns;
  const auto wanted = [&](std::int32_t c) {
    return modulo(call.samples.west + c - w.west, lattice.columns()) <= w.east - w.west;
  };
  std::int32_t first = 0, last = columns - 1;
  while (first < columns && !wanted(first)) ++first;
  while (last > first && !wanted(last)) --last;
  if (first == columns) return;
  const std::int32_t count = last - first + 1;
  std::vector<std::size_t> between;  // the window may end and begin again on the way around the earth
  for (std::int32_t c = first; c <= last; ++c)
    if (!wanted(c)) between.push_back(static_cast<std::size_t>(c - first));
  LatticePlaces places(*parts_.placement, lattice, call.samples.west + first, count, vertex_patches_);
  for (std::int32_t r = 0; r < call.samples.rows; ++r) {
    const std::int64_t j = call.samples.south + r;
    if (j < w.south || j > w.north) continue;
    double *const x = u_.data() + call.index(first, r), *const y = v_.data() + call.index(first, r);
    if (j == 0 || j == lattice.rows()) {  // a pole is one point
      std::fill_n(x, count, parts_.pole_longitude_deg);
      std::fill_n(y, count, lattice.latitude_deg(j));
      parts_.placement->to_pixels(x, y, static_cast<std::size_t>(count));
    } else {
      places.row(j, x, y);
    }
    call.kernel.locate(x, y, static_cast<std::size_t>(count));
    for (const std::size_t c : between) x[c] = y[c] = NAN;
  }
}

proto::Result<void> RasterSource::read_block() {
  if (auto done = pixels_.read(block_.window, block_.heights); !done.ok() || !beyond_) return done;
  const PixelWindow& w = block_.window;
  const bool inside = w.x >= 0 && w.y >= 0 && w.x + w.columns <= parts_.dataset.columns && w.y + w.rows <= parts_.dataset.rows;
  return inside ? proto::Result<void>() : beyond_(w, block_.heights);
}

/// Reads the pixels under rect and interpolates; cuts rect in two while they are too many.
proto::Result<void> RasterSource::resample(Call& call, const Rect& rect) {
  FiniteRange across, down;
  for (std::int32_t r = rect.r0; r < rect.r0 + rect.rows; ++r) {
    across.add(u_.data() + call.index(rect.c0, r), static_cast<std::size_t>(rect.columns));
    down.add(v_.data() + call.index(rect.c0, r), static_cast<std::size_t>(rect.columns));
  }
  if (across.empty()) return {};
  block_.window = call.kernel.around({across.low(), down.low()}, {across.high(), down.high()});
  if (std::int64_t{block_.window.columns} * block_.window.rows > kMaxBlockPixels) {
    if (rect.columns == 1 && rect.rows == 1) return resample_wide(call, call.index(rect.c0, rect.r0));
    const bool wide = rect.columns >= rect.rows;
    const std::int32_t half = (wide ? rect.columns : rect.rows) / 2;
    const Rect first = wide ? Rect{rect.c0, rect.r0, half, rect.rows} : Rect{rect.c0, rect.r0, rect.columns, half};
    const Rect second = wide ? Rect{rect.c0 + half, rect.r0, rect.columns - half, rect.rows}
                             : Rect{rect.c0, rect.r0 + half, rect.columns, rect.rows - half};
    if (auto done = resample(call, first); !done.ok()) return done;
    return resample(call, second);
  }
  if (auto done = read_block(); !done.ok()) return done;
  std::vector<double> height_m(static_cast<std::size_t>(rect.columns));
  std::vector<std::uint8_t> level(height_m.size());
  for (std::int32_t r = rect.r0; r < rect.r0 + rect.rows; ++r) {
    std::size_t from = call.index(rect.c0, r), to = from + height_m.size();
    while (from < to && std::isnan(u_[from])) ++from;
    while (from < to && std::isnan(u_[to - 1])) --to;
    if (from == to) continue;
    const PlacedRow row{to - from, u_.data() + from, v_.data() + from,
                        undulations_m(call.lattice, call.samples.west + static_cast<std::int64_t>(from - call.index(0, r)),
                                      call.samples.south + r, static_cast<std::int32_t>(to - from))};
    call.kernel.heights(row.u, row.v, row.count, block_, height_m.data(), level.data());
    for (std::size_t c = 0; c < row.count; ++c)
      level[c] = level[c] != 0 && !std::isnan(row.u[c]) && call.kernel.flat({row.u[c], row.v[c]}, block_);
    put_row(call.kernel, block_, row, height_m.data(), level.data(), from, call.samples);
  }
  return {};
}

/// One sample whose triangle alone is more than memory should hold: in strips.
proto::Result<void> RasterSource::resample_wide(Call& call, std::size_t at) {
  const PixelPosition place{u_[at], v_[at]};
  block_.window = call.kernel.near(place);
  if (auto done = read_block(); !done.ok()) return done;
  if (!call.kernel.valid(place, block_)) return {};
  const bool flat = call.kernel.flat(place, block_);
  const PixelWindow all = call.kernel.around(place, place);
  const int strip = static_cast<int>(std::max<std::int64_t>(1, kMaxBlockPixels / all.columns));
  Kernel::Sum sum;
  for (int done_rows = 0; done_rows < all.rows; done_rows += strip) {
    block_.window = {all.x, all.y + done_rows, all.columns, std::min(strip, all.rows - done_rows)};
    if (pixels_.certainly_void(block_.window)) continue;
    if (auto done = read_block(); !done.ok()) return done;
    call.kernel.add(place, block_, sum);
  }
  const auto c = static_cast<std::int64_t>(at) % call.samples.columns, r = static_cast<std::int64_t>(at) / call.samples.columns;
  put(sum.mean() + *undulations_m(call.lattice, call.samples.west + c, call.samples.south + r, 1), flat, at, call.samples);
  return {};
}

proto::Result<proto::Samples> RasterSource::sample_present(const proto::Lattice& lattice, std::int64_t west, std::int64_t south,
                                                           std::int32_t columns, std::int32_t rows) {
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  proto::Samples samples{
      west, south, columns, rows, std::vector<std::int32_t>(count, proto::kNoHeight), std::vector<std::uint8_t>(count, 0)};
  const GdalScope scope(parts_.dataset.trust);
  const Kernel kernel(frame_for(lattice));
  const auto done_in_lines = sample_lines(lattice, kernel, samples);
  if (!done_in_lines.ok()) return done_in_lines.problem();
  if (*done_in_lines) return samples;
  Call call{lattice, std::move(samples), kernel};
  u_.assign(count, NAN), v_.assign(count, NAN);
  place_samples(call);
  if (auto done = resample(call, {0, 0, columns, rows}); !done.ok()) return done.problem();
  return std::move(call.samples);
}

proto::Result<proto::Samples> RasterSource::sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south,
                                                   std::int32_t columns, std::int32_t rows) {
  const std::size_t count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  if (count == 0 || empty(lattice, west, south, columns, rows))
    return proto::Samples{
        west, south, columns, rows, std::vector<std::int32_t>(count, proto::kNoHeight), std::vector<std::uint8_t>(count, 0)};
  // A window may lie over hundreds of small rasters, each of which has a corner of it.
  const Window part = part_with_data(lattice, {west, south, west + columns - 1, south + rows - 1}, 0);
  const auto part_columns = static_cast<std::int32_t>(part.east - part.west + 1),
             part_rows = static_cast<std::int32_t>(part.north - part.south + 1);
  auto samples = sample_present(lattice, part.west, part.south, part_columns, part_rows);
  known_undulations_ = {};  // megabytes, of each raster of a mosaic that is open
  if (!samples.ok() || (part_columns == columns && part_rows == rows)) return samples;
  proto::Samples all{
      west, south, columns, rows, std::vector<std::int32_t>(count, proto::kNoHeight), std::vector<std::uint8_t>(count, 0)};
  for (std::int32_t r = 0; r < part_rows; ++r) {
    const std::int64_t from = std::int64_t{r} * part_columns, to = (part.south + r - south) * columns + (part.west - west);
    std::copy_n(samples->height.begin() + from, part_columns, all.height.begin() + to);
    std::copy_n(samples->flat_water.begin() + from, part_columns, all.flat_water.begin() + to);
  }
  return all;
}

Source::Window RasterSource::part_with_data(const proto::Lattice& lattice, const Window& asked, std::int64_t around) const {
  const Window w = window(lattice);
  Window part{asked.west, std::max(asked.south, w.south - around), asked.east, std::min(asked.north, w.north + around)};
  if (part.south > part.north) part.south = asked.south, part.north = asked.north;
  const std::int64_t wide = w.east - w.west + 2 * around;
  if (wide >= lattice.columns()) return part;
  const auto holds = [&](std::int64_t i) { return modulo(i - w.west + around, lattice.columns()) <= wide; };
  while (part.west < part.east && !holds(part.west)) ++part.west;
  while (part.east > part.west && !holds(part.east)) --part.east;
  return part;
}

proto::Result<std::shared_ptr<const Decimation>> RasterSource::decimate(std::int64_t most_pixels) {
  auto pixels = decimated(parts_.dataset, parts_.placement->period_px(), most_pixels);
  if (!pixels.ok()) return pixels.problem();
  pixels->of = parts_.description;
  pixels->look = look_at_values(parts_.dataset, parts_.height_rule, *pixels);
  return std::make_shared<const Decimation>(std::move(*pixels));
}

std::string RasterSource::datum_print() const {
  std::string print;
  for (int k = 0; k < 9; ++k) {
    const Area& a = parts_.area;
    const double lat = a.south_deg + (a.north_deg - a.south_deg) * (k / 3) / 2,
                 lon = a.west_deg + (a.east_deg - a.west_deg) * (k % 3) / 2;
    char text[32];
    std::snprintf(text, sizeof text, "%s%.4f", k == 0 ? "" : " ", undulation_m(std::clamp(lat, -90.0, 90.0), lon));
    print += text;
  }
  return print;
}

}  // namespace cordillera::raster
