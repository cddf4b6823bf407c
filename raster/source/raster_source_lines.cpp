// The usual source, whose columns and rows are longitudes and latitudes, line by line; and undulations along a parallel, for
// every source.
#include <algorithm>
#include <cmath>

#include "raster/sample/plate_lines.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {
namespace {

/// Undulations are rounded, so that the last bit of an interpolation in another library version cannot show.
constexpr double kUndulationSteps = 65536;  // a metre

/// As std::nearbyint, which a baseline processor has no instruction for. |value| < 2^51.
double rounded(double value) {
  constexpr double kShift = 0x1.8p52;
  return value + kShift - kShift;
}

/// Samples from `from` eastward; flat: null, nowhere. False when some are void: they stay so.
bool put_line(const std::vector<double>& height_m, const double* above_m, const std::uint8_t* flat, std::size_t from,
              proto::Samples& samples) {
  std::int32_t* const to = samples.height.data() + from;
  unsigned voids = 0;
  for (std::size_t c = 0; c < height_m.size(); ++c) {
    const double total_m = height_m[c] + above_m[c];
    const bool fits = std::abs(total_m) <= proto::kMaxHeight_m;
    const auto steps = static_cast<std::int32_t>(rounded((fits ? total_m : 0) / proto::kHeightStep_m));
    to[c] = fits ? steps : proto::kNoHeight;
    voids |= fits ? 0u : 1u;
  }
  if (flat != nullptr)
    for (std::size_t c = 0; c < height_m.size(); ++c) samples.flat_water[from + c] = to[c] == proto::kNoHeight ? 0 : flat[c];
  return voids == 0;
}

/// The places that are, as one stretch.
struct FiniteRange {
  double low = INFINITY, high = -INFINITY;
  explicit FiniteRange(const std::vector<double>& places) {
    for (const double at : places)
      if (!std::isnan(at)) low = std::min(low, at), high = std::max(high, at);
  }
  bool empty() const { return low > high; }
};

}  // namespace

/// 0 when the source's heights are ellipsoidal.
double RasterSource::undulation_m(double latitude_deg, double longitude_deg) const {
  if (!parts_.datum.geoid) return 0;
  return rounded(parts_.datum.geoid->undulation_m(latitude_deg, longitude_deg) * kUndulationSteps) / kUndulationSteps;
}

const double* RasterSource::undulations_m(const proto::Lattice& lattice, std::int64_t i, std::int64_t j, std::int32_t count) {
  undulations_.assign(static_cast<std::size_t>(count), 0);
  if (!parts_.datum.geoid) return undulations_.data();
  const double latitude = lattice.latitude_deg(j);
  if (j == 0 || j == lattice.rows()) {
    std::fill(undulations_.begin(), undulations_.end(), undulation_m(latitude, parts_.pole_longitude_deg));
    return undulations_.data();
  }
  longitudes_.clear();
  for (std::int32_t c = 0; c < count; ++c) longitudes_.push_back(lattice.longitude_deg(modulo(i + c, lattice.columns())));
  parts_.datum.geoid->along_parallel(latitude, longitudes_, undulations_.data());
  // So near to the middle between two steps the point itself decides: heights may not depend on what was asked for with them.
  constexpr double kTie = 0.5 - 2 * kAlongParallel_m * kUndulationSteps;
  for (std::size_t c = 0; c < undulations_.size(); ++c) {
    const double steps = undulations_[c] * kUndulationSteps, whole = rounded(steps);
    undulations_[c] = whole / kUndulationSteps;
    if (std::abs(steps - whole) > kTie) undulations_[c] = undulation_m(latitude, longitudes_[c]);
  }
  return undulations_.data();
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
  const FiniteRange across(u), down(v);
  if (across.empty() || down.empty()) return true;
  block_.window = kernel.around({across.low, down.low}, {across.high, down.high});
  if (std::int64_t{block_.window.columns} * block_.window.rows > kMaxBlockPixels) return false;
  if (auto done = pixels_.read(block_.window, block_.heights); !done.ok()) return done.problem();
  PlateLines lines(block_, u);
  std::vector<double> height_m(u.size());
  for (std::size_t k = 0; k < v.size(); ++k) {
    if (std::isnan(v[k])) continue;
    lines.heights(v[k], height_m.data());
    const std::int64_t j = south + static_cast<std::int64_t>(k);
    const double* const above_m = undulations_m(lattice, samples.west, j, samples.columns);
    const auto from = static_cast<std::size_t>(j - samples.south) * static_cast<std::size_t>(samples.columns);
    if (put_line(height_m, above_m, lines.flat(v[k]), from, samples)) continue;
    for (std::size_t c = 0; c < u.size(); ++c) {
      const PixelPosition place{u[c], v[k]};
      if (std::isnan(height_m[c]) && !std::isnan(u[c]) && kernel.valid(place, block_))
        put(samples, from + c, kernel.value(place, block_) + above_m[c], kernel.flat(place, block_));
    }
  }
  return true;
}

}  // namespace cordillera::raster
