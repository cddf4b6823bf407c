#include "proto/ellipsoid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/integers.h"

namespace cordillera::proto {
namespace {

constexpr double kAngleStep = 0x1p-40;  // 6 micrometres on the ground
constexpr double kDistanceStep_m = 0x1p-20;

double rounded(double value, double step) { return std::nearbyint(value / step) * step; }

struct Direction {
  double sin = 0, cos = 0;
};

// sin and cos of the n-th part of the circle, i times. n is a multiple of 8.
Direction circle(std::int64_t i, std::int64_t n) {
  const std::int64_t wrapped = modulo(i, n);
  const std::int64_t quarter = n / 4;
  const std::int64_t quadrant = wrapped / quarter;
  const std::int64_t rest = wrapped % quarter;
  const auto octant = [&](std::int64_t k) { return 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n); };
  const bool upper = 2 * rest > quarter;
  const double a = octant(upper ? quarter - rest : rest);
  double s = rounded(std::sin(a), kAngleStep), c = rounded(std::cos(a), kAngleStep);
  if (upper) std::swap(s, c);
  switch (quadrant) {
    case 0: return {s, c};
    case 1: return {c, -s};
    case 2: return {-s, -c};
    default: return {-c, s};
  }
}

}  // namespace

RowFrame row_frame(const Lattice& lattice, std::int64_t row) {
  const double e2 = kFlattening * (2 - kFlattening);
  const Direction lat = circle(std::clamp<std::int64_t>(row, 0, lattice.rows()) - lattice.rows() / 2, 2 * lattice.rows());
  const double n = kSemiMajor_m / std::sqrt(1 - e2 * lat.sin * lat.sin);
  return {lat.sin, lat.cos, rounded(n * lat.cos, kDistanceStep_m), rounded(n * (1 - e2) * lat.sin, kDistanceStep_m)};
}

ColumnFrame column_frame(const Lattice& lattice, std::int64_t column) {
  const Direction lon = circle(column - lattice.columns() / 2, lattice.columns());
  return {lon.sin, lon.cos};
}

std::vector<RowFrame> row_frames(const Lattice& lattice, std::int64_t south, std::size_t count) {
  std::vector<RowFrame> frames(count);
  for (std::size_t k = 0; k < count; ++k) frames[k] = row_frame(lattice, south + static_cast<std::int64_t>(k));
  return frames;
}

std::vector<ColumnFrame> column_frames(const Lattice& lattice, std::int64_t west, std::size_t count) {
  std::vector<ColumnFrame> frames(count);
  for (std::size_t k = 0; k < count; ++k) frames[k] = column_frame(lattice, west + static_cast<std::int64_t>(k));
  return frames;
}

double cell_height_m(const Lattice& lattice, std::int64_t row) {
  const double e2 = kFlattening * (2 - kFlattening);
  const Direction lat = circle(row - lattice.rows() / 2, 2 * lattice.rows());
  const double w2 = 1 - e2 * lat.sin * lat.sin;
  const double meridian_radius = kSemiMajor_m * (1 - e2) / (w2 * std::sqrt(w2));
  return meridian_radius * std::numbers::pi / static_cast<double>(lattice.rows());
}

}  // namespace cordillera::proto
