#include "gpu/measure/sample_meter.h"

#include <algorithm>
#include <cmath>

#include "gpu/mesh/lattice_triangle.h"

namespace cordillera::gpu {
namespace {

// Rows nearer to a pole than 86.4 degrees.
constexpr double kPolarCosine = 1.0 / 16;

// Of all that may become a corner: the mesh's vertices and the tile's samples, rounded.
std::pair<double, double> height_range_m(const SurfaceErrorInput& in, std::int32_t step) {
  RowHeights seen;
  see_heights(in.mesh->height.data(), in.mesh->height.size(), seen);
  const SampleWindow window(in, in.mesh->side);
  for (std::int64_t y = window.rows().first; y <= window.rows().last; ++y)
    for (const auto& s : window.stretches()) see_heights(window.row(y) + s.columns.first + s.shift, length(s.columns), seen);
  if (seen.valid == 0) seen.lowest = seen.highest = 0;
  return {(seen.lowest - step) * proto::kHeightStep_m, (seen.highest + step) * proto::kHeightStep_m};
}

}  // namespace

SampleMeter::SampleMeter(const SurfaceErrorInput& input, std::int32_t height_step)
    : meter_(input, height_range_m(input, height_step)),
      side_(input.mesh->side),
      lattice_(*input.lattice),
      south_(lattice_.south(input.tile)) {}

// Beside a pole a row's columns are hundreds of times closer than its rows. Vertices at any of them make needles along lines that
// are straight in plan and not in space.
std::int64_t SampleMeter::columns_apart(std::int64_t y) const {
  const double cos_lat = proto::row_frame(lattice_, std::clamp<std::int64_t>(south_ + y, 1, lattice_.rows() - 1)).cos_lat;
  return cos_lat < kPolarCosine ? std::int64_t{1} << std::clamp(-std::ilogb(cos_lat) - 1, 0, 30) : 1;
}

MeasuredTriangle SampleMeter::triangle(const std::array<MeshPoint, 3>& corners) const {
  const auto corner = [&](std::size_t k) { return meter_.corner(corners[k].x, corners[k].y, corners[k].height); };
  const Corner three[3] = {corner(0), corner(1), corner(2)};
  return meter_.triangle(three, 0);
}

double SampleMeter::error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const {
  return std::max(meter_.greatest_m(triangle(corners), asked), 0.0);
}

TriangleError SampleMeter::measure(const std::array<MeshPoint, 3>& corners, double limit_m) const {
  const MeasuredTriangle triangle = this->triangle(corners);
  NoTally tally;
  TriangleWorst worst = meter_.worst(triangle, limit_m, tally);
  TriangleError error;
  error.error_m = std::max(worst.any.error_m, 0.0);
  if (error.error_m <= limit_m) return error;
  const auto offer = [&](std::int64_t x, std::int64_t y) {
    const std::int32_t height = meter_.window().at(x, y);
    const bool inside = x > 0 && y > 0 && x < side_ && y < side_;
    if (inside && height != proto::kNoHeight) error.offer({static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), height});
  };
  // Where only samples beyond its edges are too far, any corner more makes the triangle smaller.
  const WorstSample any = worst.any;
  if (worst.inside.error_m < 0) worst = meter_.worst(triangle, -1, tally);
  if (worst.inside.error_m >= 0) {
    const std::int64_t x = worst.inside.x, y = worst.inside.y, apart = columns_apart(y);
    const auto rounded = [&](std::int64_t unit) {
      return std::clamp((x + unit / 2) / unit * unit, std::min(unit, side_ / 2), std::max(side_ - unit, side_ / 2));
    };
    for (std::int64_t unit = apart; unit > 1 && unit >= apart / 16; unit /= 4) offer(rounded(unit), y);
    offer(x, y);
    return error;
  }
  // A needle between samples: vertices beside its worst corner part it from what lies around.
  const std::int64_t apart = columns_apart(any.y);
  const std::int64_t east = (any.x / apart + 1) * apart, west = (any.x - 1) / apart * apart;
  for (const auto& [x, y] : {std::pair{east, any.y}, {west, any.y}, {any.x, any.y + 1}, {any.x, any.y - 1}}) offer(x, y);
  return error;
}

std::optional<std::array<MeshPoint, 3>> SampleMeter::wanted(const std::array<MeshPoint, 3>& corners, double limit_m) const {
  NoTally tally;
  const WorstSample worst = meter_.worst(triangle(corners), limit_m, tally).any;
  if (worst.error_m <= limit_m || columns_apart(worst.y) > 1) return std::nullopt;
  const auto x = static_cast<std::int32_t>(worst.x), y = static_cast<std::int32_t>(worst.y);
  const std::int64_t east = std::int64_t{corners[0].x} + corners[1].x + corners[2].x - 3 * std::int64_t{x},
                     north = std::int64_t{corners[0].y} + corners[1].y + corners[2].y - 3 * std::int64_t{y};
  return lattice_triangle(x, y, east, north);
}

std::optional<std::array<MeshPoint, 3>> SampleMeter::lattice_triangle(std::int32_t x, std::int32_t y, std::int64_t east,
                                                                      std::int64_t north) const {
  const std::int32_t i = east >= 0 ? x : x - 1, j = north >= 0 ? y : y - 1;  // the cell's south-western corner
  if (i < 0 || j < 0 || i >= side_ || j >= side_) return std::nullopt;
  // A little off the corner. By a power of two, so that nothing is rounded.
  const double near =
      std::exp2(-3 - std::ilogb(static_cast<double>(std::max({std::abs(east), std::abs(north), std::int64_t{1}}))));
  return gpu::lattice_triangle(i, j, x - i + near * static_cast<double>(east), y - j + near * static_cast<double>(north),
                               [&](std::int32_t column, std::int32_t row) { return meter_.window().at(column, row); });
}

}  // namespace cordillera::gpu
