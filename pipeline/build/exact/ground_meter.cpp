#include "pipeline/build/exact/ground_meter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gpu/exact/steps/coded.h"
#include "gpu/measure/sample_meter.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

constexpr std::int64_t kMargin = 2;  // units: samples beside a triangle that its chords may show

/// And so many rows nearer to the pole than `row`, between two places on it or farther from the pole that are so many columns
/// apart: tan(colatitude) shrinks by the cosine of half of their longitudes' difference.
std::int64_t bulge_rows(const proto::Lattice& lattice, std::int64_t row, std::int64_t columns) {
  const double cell_rad = lattice.cell_deg() * std::numbers::pi / 180;
  const double colatitude = static_cast<double>(std::min(row, lattice.rows() - row)) * cell_rad;
  const double half = std::min(0.5 * static_cast<double>(columns) * cell_rad, std::numbers::pi / 2);
  return static_cast<std::int64_t>(std::ceil((colatitude - std::atan(std::tan(colatitude) * std::cos(half))) / cell_rad));
}
constexpr double kRounded = 1;  // of a height to whole steps, and more

/// What std::lround gives, without a call.
std::int32_t nearest(float height) {
  const double h = height;
  return static_cast<std::int32_t>(h < 0 ? h - 0.5 : h + 0.5);
}

/// A meter of one triangle needs its tile's side, and the range of its heights.
proto::TileMesh mesh_of(std::int32_t side, const std::array<gpu::MeshPoint, 3>& corners) {
  proto::TileMesh mesh;
  mesh.side = side;
  for (const gpu::MeshPoint& p : corners) {
    mesh.x.push_back(p.x);
    mesh.y.push_back(p.y);
    mesh.height.push_back(p.height);
    mesh.mark.push_back(0);
  }
  mesh.triangles.push_back({0, 1, 2});
  return mesh;
}

}  // namespace

gpu::exact::Field field_of(const gpu::exact::Ground& ground) {
  gpu::exact::Field field;
  field.columns = ground.columns, field.rows = ground.rows;
  field.tier_stride[0] = static_cast<std::int32_t>(ground.across());
  field.plane[0] = ground.squares.plane.data();
  field.code = ground.squares.code.data();
  field.code_unit = ground.code_unit;
  field.curve = {ground.curve.empty() ? nullptr : ground.curve.data(), ground.curve_up};
  return field;
}

namespace {

/// Where a ground's samples lie.
proto::Samples place_of(const gpu::exact::Ground& ground) {
  proto::Samples place;
  place.west = ground.west, place.south = ground.south;
  place.columns = ground.columns, place.rows = ground.rows;
  return place;
}

}  // namespace

KnownGround::KnownGround(const proto::Lattice& lattice, const gpu::exact::Ground& of)
    : ground(of), frames(lattice, place_of(of)) {}

GroundMeter::GroundMeter(const At& at, const KnownGround& known)
    : at_(at), ground_(known.ground), frames_(known.frames), field_(field_of(known.ground)) {
  const gpu::exact::Ground& ground = known.ground;
  const std::int64_t circle = at.lattice->columns();
  const std::int64_t west = at.lattice->west(at.tile);
  // On the turn on which the tile has cells of the ground; there is one (grid_of).
  west_ = west + proto::floor_divide(ground.west + ground.columns - 2 - west, circle) * circle - ground.west;
  south_ = at.lattice->south(at.tile) - ground.south;
}

GroundMeter::Known GroundMeter::around(const std::array<gpu::MeshPoint, 3>& corners) const {
  const auto [from_x, to_x] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
  const auto [from_y, to_y] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  const std::int64_t west = std::max<std::int64_t>(west_ + from_x - kMargin, 0),
                     east = std::min<std::int64_t>(west_ + to_x + kMargin, ground_.columns - 1);
  const proto::Lattice& lattice = *at_.lattice;
  const std::int64_t lowest = ground_.south + south_ + from_y, highest = ground_.south + south_ + to_y, wide = to_x - from_x;
  const std::int64_t below = 2 * lowest < lattice.rows() ? bulge_rows(lattice, lowest, wide) : 0,
                     above = 2 * highest > lattice.rows() ? bulge_rows(lattice, highest, wide) : 0;
  const std::int64_t south = std::max<std::int64_t>(south_ + from_y - below - kMargin, 0),
                     north = std::min<std::int64_t>(south_ + to_y + above + kMargin, ground_.rows - 1);
  const auto columns = static_cast<std::size_t>(east - west + 1), rows = static_cast<std::size_t>(north - south + 1);
  Known known{{}, {frames_, static_cast<std::size_t>(south), rows, static_cast<std::size_t>(west), columns}, 0};
  proto::Samples& samples = known.samples;
  samples.west = ground_.west + west, samples.south = ground_.south + south;
  samples.columns = static_cast<std::int32_t>(columns), samples.rows = static_cast<std::int32_t>(rows);
  samples.height.reserve(columns * rows);
  float error = 0;
  for (std::int64_t j = south; j <= north; ++j) {
    std::uint32_t last = UINT32_MAX;  // square, of whose samples one is enough
    for (std::int64_t i = west; i <= east; ++i) {
      const int x = static_cast<int>(i), y = static_cast<int>(j);
      const bool none = field_.is_void_there(x, y);
      samples.height.push_back(none ? proto::kNoHeight : nearest(field_.height_at(x, y)));
      const std::uint32_t square = field_.square_of(x, y);
      if (none || square == last) continue;
      error = std::max(error, gpu::exact::code_error(field_.plane[0][square], field_.code_unit));
      last = square;
    }
  }
  known.error_m = (error + kRounded) * proto::kHeightStep_m;
  return known;
}

template <class Ask>
auto GroundMeter::with_samples(const std::array<gpu::MeshPoint, 3>& corners, const Known& known, const Ask& ask) const {
  const proto::TileMesh mesh = mesh_of(at_.side, corners);
  return ask(gpu::SampleMeter({at_.lattice, at_.tile, &mesh, &known.samples, at_.ecef_steps, &known.frames}, at_.height_step));
}

gpu::TriangleError GroundMeter::measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const {
  const Known known = around(corners);
  gpu::TriangleError error = with_samples(
      corners, known, [&](const gpu::SampleMeter& meter) { return meter.measure(corners, limit_m - known.error_m); });
  error.error_m += known.error_m;
  return error;
}

std::optional<std::array<gpu::MeshPoint, 3>> GroundMeter::wanted(const std::array<gpu::MeshPoint, 3>& corners,
                                                                 double limit_m) const {
  const Known known = around(corners);
  return with_samples(corners, known,
                      [&](const gpu::SampleMeter& meter) { return meter.wanted(corners, limit_m - known.error_m); });
}

double GroundMeter::error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance&) const {
  return measure(corners, INFINITY).error_m;
}

}  // namespace cordillera::pipeline
