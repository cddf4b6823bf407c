// The usual source, whose columns and rows are longitudes and latitudes, line by line; and undulations along a parallel, for
// every source.
#include <algorithm>
#include <cmath>

#include "proto/wide.h"
#include "raster/sample/plate_lines.h"
#include "raster/source/placed_row.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {
namespace {

/// Undulations are rounded, so that the last bit of an interpolation in another library version cannot show.
constexpr double kUndulationSteps = 65536;  // a metre

double to_steps(double undulation_m) { return std::nearbyint(undulation_m * kUndulationSteps) / kUndulationSteps; }

/// Longitudes of count columns from i on, none of them in the next turn.
CORDILLERA_WIDE void columns_deg(const proto::Lattice& lattice, std::int64_t i, std::int32_t count, double* out) {
  const double first = static_cast<double>(i);
  for (std::int32_t c = 0; c < count; ++c) out[c] = lattice.longitude_at_deg(first + c);
}

/// Whole steps of what is near enough to the point's own undulation; false when it is so near to the middle between two steps for
/// some that the point itself decides: heights may not depend on what was asked for with them.
constexpr double kTie = 0.5 - 2 * kAlongParallel_m * kUndulationSteps;
bool is_tie(double near_m) { return std::abs(near_m - to_steps(near_m)) * kUndulationSteps > kTie; }
CORDILLERA_WIDE bool round_undulations(const double* near_m, std::size_t count, double* out) {
  unsigned ties = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const double steps = near_m[c] * kUndulationSteps, whole = std::nearbyint(steps);
    out[c] = whole / kUndulationSteps;
    ties |= std::abs(steps - whole) > kTie ? 1u : 0u;
  }
  return ties == 0;
}

}  // namespace

/// 0 when the source's heights are ellipsoidal.
double RasterSource::undulation_m(double latitude_deg, double longitude_deg) const {
  if (!parts_.datum.geoid) return 0;
  return to_steps(parts_.datum.geoid->undulation_m(latitude_deg, longitude_deg));
}

const double* RasterSource::undulations_m(const proto::Lattice& lattice, std::int64_t i, std::int64_t j, std::int32_t count) {
  if (const double* const known = known_undulations_.row(lattice, i, j, count)) return known;
  undulations_.assign(static_cast<std::size_t>(count), 0);
  if (!parts_.datum.geoid) return undulations_.data();
  const double latitude = lattice.latitude_deg(j);
  if (j == 0 || j == lattice.rows()) {
    std::fill(undulations_.begin(), undulations_.end(), undulation_m(latitude, parts_.pole_longitude_deg));
    return undulations_.data();
  }
  longitudes_.resize(undulations_.size());
  near_.resize(undulations_.size());
  for (std::int32_t c = 0; c < count;) {  // a turn at a time
    const std::int64_t first = modulo(i + c, lattice.columns());
    const auto part = static_cast<std::int32_t>(std::min<std::int64_t>(count - c, lattice.columns() - first));
    columns_deg(lattice, first, part, longitudes_.data() + c);
    parts_.datum.geoid->along_parallel(latitude, {longitudes_.data() + c, static_cast<std::size_t>(part)}, near_.data() + c);
    c += part;
  }
  if (round_undulations(near_.data(), near_.size(), undulations_.data())) return undulations_.data();
  for (std::size_t c = 0; c < near_.size(); ++c)
    if (is_tie(near_[c])) undulations_[c] = undulation_m(latitude, longitudes_[c]);
  return undulations_.data();
}

const double* RasterSource::UndulationGrid::row(const proto::Lattice& lattice, std::int64_t i, std::int64_t j,
                                                std::int32_t count) const {
  const bool holds = lattice.finest_level == level && i >= west && i + count <= west + columns && j >= south &&
                     (j - south + 1) * columns <= static_cast<std::int64_t>(at_m.size());
  return holds ? at_m.data() + (j - south) * columns + (i - west) : nullptr;
}

void RasterSource::see_undulations(const proto::Lattice& lattice, const Window& cells) {
  UndulationGrid grid{lattice.finest_level, cells.west, cells.south, cells.east - cells.west + 2, {}};
  grid.at_m.reserve(static_cast<std::size_t>(grid.columns * (cells.north - cells.south + 2)));
  for (std::int64_t j = cells.south; j <= cells.north + 1; ++j) {
    const double* const row_m =
        undulations_m(lattice, cells.west, std::min(j, lattice.rows()), static_cast<std::int32_t>(grid.columns));
    grid.at_m.insert(grid.at_m.end(), row_m, row_m + grid.columns);
  }
  known_undulations_ = std::move(grid);
}

/// Kernel's places of the columns from west, NaN where they are not wanted or lie outside.
std::vector<double> RasterSource::column_places(const proto::Lattice& lattice, const Kernel& kernel, std::int64_t west,
                                                std::int32_t columns) const {
  const Window w = window(lattice);
  std::vector<double> u, any_latitude(static_cast<std::size_t>(columns), lattice.latitude_deg(w.south));
  for (std::int32_t c = 0; c < columns; ++c) u.push_back(lattice.longitude_deg(modulo(west + c, lattice.columns())));
  parts_.placement->to_pixels(u.data(), any_latitude.data(), u.size());
  for (std::int32_t c = 0; c < columns; ++c) {
    const bool wanted = modulo(west + c - w.west, lattice.columns()) <= w.east - w.west;
    u[static_cast<std::size_t>(c)] = wanted ? kernel.locate_u(u[static_cast<std::size_t>(c)]) : NAN;
  }
  return u;
}

std::vector<double> RasterSource::row_places(const proto::Lattice& lattice, const Kernel& kernel, std::int64_t south,
                                             std::int64_t north) const {
  std::vector<double> v;
  for (std::int64_t j = south; j <= north; ++j) v.push_back(lattice.latitude_deg(j));
  std::vector<double> any_longitude(v.size(), lattice.longitude_deg(modulo(window(lattice).west, lattice.columns())));
  parts_.placement->to_pixels(any_longitude.data(), v.data(), v.size());
  for (double& at : v) at = kernel.locate_v(at);
  return v;
}

proto::Result<bool> RasterSource::sample_lines(const proto::Lattice& lattice, const Kernel& kernel, proto::Samples& samples) {
  if (!parts_.placement->straight_plate() || kernel.reduces()) return false;
  const Window w = window(lattice);
  const std::int64_t south = std::max(samples.south, w.south), north = std::min(samples.south + samples.rows - 1, w.north);
  if (south <= 0 || north >= lattice.rows()) return false;  // a pole row is one point
  const std::vector<double> u = column_places(lattice, kernel, samples.west, samples.columns),
                            v = row_places(lattice, kernel, south, north);
  FiniteRange across, down;
  across.add(u.data(), u.size());
  down.add(v.data(), v.size());
  if (across.empty() || down.empty()) return true;
  block_.window = kernel.around({across.low(), down.low()}, {across.high(), down.high()});
  if (std::int64_t{block_.window.columns} * block_.window.rows > kMaxBlockPixels) return false;
  if (auto done = read_block(); !done.ok()) return done.problem();
  PlateLines lines(block_, u);
  std::vector<double> height_m(u.size()), row_v(u.size());
  for (std::size_t k = 0; k < v.size(); ++k) {
    if (std::isnan(v[k])) continue;
    lines.heights(v[k], height_m.data());
    const std::int64_t j = south + static_cast<std::int64_t>(k);
    std::fill(row_v.begin(), row_v.end(), v[k]);
    const PlacedRow row{u.size(), u.data(), row_v.data(), undulations_m(lattice, samples.west, j, samples.columns)};
    put_row(kernel, block_, row, height_m.data(), lines.flat(v[k]),
            static_cast<std::size_t>(j - samples.south) * static_cast<std::size_t>(samples.columns), samples);
  }
  return true;
}

}  // namespace cordillera::raster
