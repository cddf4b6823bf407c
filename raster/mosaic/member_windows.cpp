#include "raster/mosaic/member_windows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/ellipsoid.h"
#include "proto/integers.h"

namespace cordillera::raster {

using proto::floor_divide;
using proto::modulo;
using Window = Source::Window;

bool is_of_points(const proto::Source& source) { return source.pixel() == "point"; }

Window coarser(const Window& window, const proto::Lattice& lattice) {
  const std::int64_t units = std::int64_t{1} << (proto::kMaxLevel - lattice.finest_level);
  // A rim on a vertex, but for the last bit, is on it.
  const std::int64_t rim = units > 1 ? 1 : 0;
  return {-floor_divide(rim - window.west, units), std::max<std::int64_t>(0, -floor_divide(rim - window.south, units)),
          floor_divide(window.east + rim, units), std::min(lattice.rows(), floor_divide(window.north + rim, units))};
}

Window middles_of(const Window& cells, const proto::Lattice& lattice) {
  const std::int64_t units = std::int64_t{1} << (proto::kMaxLevel - lattice.finest_level);
  const auto first = [&](std::int64_t vertex) { return floor_divide((2 * vertex + 1) * units, 2); };
  const auto last = [&](std::int64_t vertex) { return -floor_divide((1 - 2 * vertex) * units, 2); };
  return {first(cells.west), first(cells.south), last(cells.east), last(cells.north)};
}

Window around(std::span<const double> longitude_deg, std::span<const double> latitude_deg) {
  const auto [west, east] = std::minmax_element(longitude_deg.begin(), longitude_deg.end());
  const auto [south, north] = std::minmax_element(latitude_deg.begin(), latitude_deg.end());
  const double cells_a_degree = 1 / kMemberLattice.cell_deg();
  const auto low = [&](double deg) { return static_cast<std::int64_t>(std::floor(deg * cells_a_degree)); };
  return {low(*west + 180), low(*south + 90), low(*east + 180) + 1, low(*north + 90) + 1};
}

bool touch(const Window& a, const Window& b, const proto::Lattice& lattice) {
  if (a.west > a.east || b.west > b.east || a.south > b.north || b.south > a.north) return false;
  return modulo(b.west - a.west, lattice.columns()) <= a.east - a.west ||
         modulo(a.west - b.west, lattice.columns()) <= b.east - b.west;
}

std::int64_t reach_of_points(const proto::Source& source, const proto::Lattice& lattice) {
  return is_of_points(source) ? reach_beyond(source, lattice) : 0;
}

Window widened(const Window& w, std::int64_t by) { return {w.west - by, w.south - by, w.east + by, w.north + by}; }

int feather_vertices(double feather_m, const proto::Lattice& lattice) {
  const double cell_m = proto::cell_height_m(lattice, lattice.rows() / 2);
  return static_cast<int>(std::clamp(std::nearbyint(feather_m / cell_m), 0.0, static_cast<double>(kMostFeather)));
}

std::int64_t reach_beyond(const proto::Source& source, const proto::Lattice& lattice) {
  const double cell_m = proto::cell_height_m(lattice, lattice.rows() / 2);
  const double poleward = std::max(std::abs(source.bbox(1)), std::abs(source.bbox(3))) / 180 * std::numbers::pi;
  const double cell_width_m = cell_m * std::max(std::cos(poleward), 0.01);
  // Two pixels where the kernel is as wide as they are; where it is wider, about two cells. From points it is one more to the
  // next.
  const double cells_a_pixel = std::max({source.pixel_width_m() / cell_width_m, source.pixel_height_m() / cell_m, 1.0});
  return static_cast<std::int64_t>(std::ceil((is_of_points(source) ? 3 : 2) * cells_a_pixel)) + 1;
}

}  // namespace cordillera::raster
