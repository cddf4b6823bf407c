#include "raster/sample/kernel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "proto/wide.h"

namespace cordillera::raster {
namespace {

constexpr double kSnap_px = 1e-6;
constexpr double kOutside = std::numeric_limits<double>::quiet_NaN();

/// To a pixel centre (integer) or edge (half) when as good as there.
inline double snap(double u) {
  const double halves = std::nearbyint(2 * u);
  return std::abs(2 * u - halves) < 2 * kSnap_px ? halves / 2 : u;
}

/// First and last pixel whose closed interval [c - 1/2, c + 1/2] holds u.
std::pair<std::int64_t, std::int64_t> covering(double u, int count, bool wraps) {
  const double edge = u + 0.5;
  const auto last = static_cast<std::int64_t>(std::floor(edge));
  const std::int64_t first = edge == std::floor(edge) ? last - 1 : last;
  if (wraps) return {first, last};
  return {std::max<std::int64_t>(first, 0), std::min<std::int64_t>(last, count - 1)};
}

CORDILLERA_WIDE void wrap(double* x, std::size_t count, double period) {
  for (std::size_t k = 0; k < count; ++k) x[k] -= period * std::floor(x[k] / period);
}

CORDILLERA_WIDE void locate_inside(double* x, double* y, std::size_t count, PixelPosition low, PixelPosition high) {
  for (std::size_t k = 0; k < count; ++k) {
    const double u = snap(x[k] - 0.5), v = snap(y[k] - 0.5);
    const bool inside = (u >= low.u) & (u <= high.u) & (v >= low.v) & (v <= high.v);
    x[k] = inside ? u : kOutside;
    y[k] = inside ? v : kOutside;
  }
}

/// Differences keep a flat surface exactly flat.
inline double linear(double a, double b, double share) { return a + share * (b - a); }

CORDILLERA_WIDE void bilinear_row(const double* u, const double* v, std::size_t count, const PixelBlock& block, double* out,
                                  std::uint8_t* level) {
  const double* const pixels = block.heights.data();
  const std::int32_t columns = block.window.columns;
  const double west = static_cast<double>(block.window.x), top = static_cast<double>(block.window.y);
  for (std::size_t k = 0; k < count; ++k) {
    const double left = std::floor(u[k]), above = std::floor(v[k]);
    const std::int32_t at = static_cast<std::int32_t>(u[k] == u[k] ? (above - top) * columns + (left - west) : 0);
    const double *const upper = pixels + at, *const lower = upper + columns;
    const double a = upper[0], b = upper[1], c = lower[0], d = lower[1];
    out[k] = linear(linear(a, b, u[k] - left), linear(c, d, u[k] - left), v[k] - above);
    level[k] = (a == b) & (b == c) & (c == d);
  }
}

}  // namespace

double Kernel::locate_u(double px) const {
  if (frame_.period != 0) px -= frame_.period * std::floor(px / frame_.period);
  const double u = snap(px - 0.5);
  return frame_.period != 0 || (u >= -rim() && u <= frame_.columns - 1 + rim()) ? u : kOutside;
}

double Kernel::locate_v(double py) const {
  const double v = snap(py - 0.5);
  return v >= -rim() && v <= frame_.rows - 1 + rim() ? v : kOutside;
}

void Kernel::locate(double* x, double* y, std::size_t count) const {
  if (frame_.period != 0) wrap(x, count, frame_.period);
  const double low_u = frame_.period != 0 ? -INFINITY : -rim(),
               high_u = frame_.period != 0 ? INFINITY : frame_.columns - 1 + rim();
  locate_inside(x, y, count, {low_u, -rim()}, {high_u, frame_.rows - 1 + rim()});
}

PixelWindow Kernel::around(const PixelPosition& low, const PixelPosition& high) const {
  const double mx = reduces_ ? frame_.ratio_x + 1 : 2, my = reduces_ ? frame_.ratio_y + 1 : 2;
  PixelWindow w;
  w.x = static_cast<std::int64_t>(std::floor(low.u - mx));
  w.y = static_cast<std::int64_t>(std::floor(low.v - my));
  w.columns = static_cast<int>(static_cast<std::int64_t>(std::ceil(high.u + mx)) - w.x + 1);
  w.rows = static_cast<int>(static_cast<std::int64_t>(std::ceil(high.v + my)) - w.y + 1);
  return w;
}

PixelWindow Kernel::near(const PixelPosition& place) const {
  return {static_cast<std::int64_t>(std::floor(place.u)) - 2, static_cast<std::int64_t>(std::floor(place.v)) - 2, 6, 6};
}

bool Kernel::valid(const PixelPosition& place, const PixelBlock& block) const {
  if (frame_.point) {
    const auto x0 = static_cast<std::int64_t>(std::floor(place.u)), y0 = static_cast<std::int64_t>(std::floor(place.v));
    const std::int64_t x1 = static_cast<double>(x0) == place.u ? x0 : x0 + 1,
                       y1 = static_cast<double>(y0) == place.v ? y0 : y0 + 1;
    return !std::isnan(block.at(x0, y0)) && !std::isnan(block.at(x1, y0)) && !std::isnan(block.at(x0, y1)) &&
           !std::isnan(block.at(x1, y1));
  }
  const auto [x0, x1] = covering(place.u, frame_.columns, frame_.period != 0);
  const auto [y0, y1] = covering(place.v, frame_.rows, false);
  for (std::int64_t y = y0; y <= y1; ++y)
    for (std::int64_t x = x0; x <= x1; ++x)
      if (!std::isnan(block.at(x, y))) return true;
  return false;
}

bool Kernel::flat(const PixelPosition& place, const PixelBlock& block) const {
  const auto x = static_cast<std::int64_t>(std::nearbyint(place.u)), y = static_cast<std::int64_t>(std::nearbyint(place.v));
  const double height = block.at(x, y);
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx)
      if (!(block.at(x + dx, y + dy) == height)) return false;  // NaN equals nothing
  return true;
}

double Kernel::value(const PixelPosition& place, const PixelBlock& block) const {
  if (!reduces_) return bilinear(place, block);
  Sum sum;
  add(place, block, sum);
  return sum.mean();
}

double Kernel::bilinear(const PixelPosition& place, const PixelBlock& block) const {
  const double left = std::floor(place.u), top = std::floor(place.v);
  const double fx = place.u - left, fy = place.v - top;
  const auto x = static_cast<std::int64_t>(left), y = static_cast<std::int64_t>(top);
  const double a = block.at(x, y), b = block.at(x + 1, y), c = block.at(x, y + 1), d = block.at(x + 1, y + 1);
  const double all = a + b + c + d;
  if (!std::isnan(all)) return linear(linear(a, b, fx), linear(c, d, fx), fy);
  const double heights[4] = {a, b, c, d};
  const double weights[4] = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  double first = 0, sum = 0, weight = 0;
  for (int k = 0; k < 4; ++k) {
    if (std::isnan(heights[k]) || weights[k] == 0) continue;
    if (weight == 0) first = heights[k];
    sum += weights[k] * (heights[k] - first);
    weight += weights[k];
  }
  return first + sum / weight;
}

void Kernel::heights(const double* u, const double* v, std::size_t count, const PixelBlock& block, double* out,
                     std::uint8_t* level) const {
  if (!reduces_) return bilinear_row(u, v, count, block, out, level);
  std::fill_n(out, count, kOutside);
  std::fill_n(level, count, std::uint8_t{1});
}

void Kernel::add(const PixelPosition& place, const PixelBlock& block, Sum& sum) const {
  const PixelWindow& w = block.window;
  const auto x0 = static_cast<std::int64_t>(std::ceil(place.u - frame_.ratio_x)),
             x1 = static_cast<std::int64_t>(std::floor(place.u + frame_.ratio_x));
  const auto y0 = std::max<std::int64_t>(static_cast<std::int64_t>(std::ceil(place.v - frame_.ratio_y)), w.y);
  const auto y1 = std::min<std::int64_t>(static_cast<std::int64_t>(std::floor(place.v + frame_.ratio_y)), w.y + w.rows - 1);
  for (std::int64_t y = y0; y <= y1; ++y) {
    const double wy = 1 - std::abs(static_cast<double>(y) - place.v) / frame_.ratio_y;
    if (wy <= 0) continue;
    double line = 0, line_weight = 0;
    for (std::int64_t x = x0; x <= x1; ++x) {
      const double height = block.at(x, y), wx = 1 - std::abs(static_cast<double>(x) - place.u) / frame_.ratio_x;
      if (std::isnan(height) || wx <= 0) continue;
      line += wx * height;
      line_weight += wx;
    }
    sum.value += wy * line;
    sum.weight += wy * line_weight;
  }
}

}  // namespace cordillera::raster
