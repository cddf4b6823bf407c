#include "pipeline/bound/loose_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "gpu/measure/surface_error.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr std::uint32_t kLeaf = 16;
// Frames are rounded to some micrometres on the ground, which on a sliver as steep as a wall is millimetres of height.
constexpr double kPlace_m = 2e-5, kSteepest = 1e4;

/// The greatest value of an edge's cross product over a box: what is less than -slack is outside.
std::int64_t most_left_of(const gpu::PlanEdge& e, std::int64_t west, std::int64_t south, std::int64_t east, std::int64_t north) {
  return e.dx * ((e.dx > 0 ? north : south) - e.y) - e.dy * ((e.dy > 0 ? west : east) - e.x);
}

/// What roundings of a place are in height, on the steeper decoding.
double graze_m(const gpu::MeasuredTriangle& t, const proto::Vec3& up) {
  double most = 0;
  for (const gpu::Plane* plane : {&t.exact, &t.rounded}) {
    if (!plane->shows()) continue;
    const double rise = std::abs(dot(plane->normal, up)), whole = length(plane->normal);
    most = std::max(most, rise * kSteepest > whole ? whole / rise : kSteepest);
  }
  return kPlace_m * most;
}

}  // namespace

LooseSamples::LooseSamples(const proto::Lattice& lattice, const proto::TileAddress& tile, std::int32_t side,
                           const gpu::EcefSteps& ecef_steps, std::vector<gpu::MeshPoint> samples)
    : lattice_(lattice), west_(lattice.west(tile)), south_(lattice.south(tile)), samples_(std::move(samples)) {
  tile_.side = side;
  tile_.unit_rad = std::numbers::pi / static_cast<double>(lattice.rows());
  tile_.ecef_steps = ecef_steps;
  tile_.off_south_pole = proto::row_frame(lattice, 1);
  tile_.off_north_pole = proto::row_frame(lattice, lattice.rows() - 1);
  if (samples_.empty()) return;
  boxes_.push_back({0, 0, 0, 0, 0, static_cast<std::uint32_t>(samples_.size()), 0});
  for (std::uint32_t box = 0; box < boxes_.size(); ++box) divide(box);
}

void LooseSamples::divide(std::uint32_t at) {
  Box& box = boxes_[at];
  const auto from = samples_.begin() + box.first, to = samples_.begin() + box.last;
  const auto [west, east] = std::minmax_element(from, to, [](const auto& a, const auto& b) { return a.x < b.x; });
  const auto [south, north] = std::minmax_element(from, to, [](const auto& a, const auto& b) { return a.y < b.y; });
  box.west = west->x, box.east = east->x, box.south = south->y, box.north = north->y;
  if (box.last - box.first <= kLeaf) return;
  const std::uint32_t middle = (box.first + box.last) / 2;
  const bool wide = box.east - box.west > box.north - box.south;
  std::nth_element(from, samples_.begin() + middle, to, [wide](const gpu::MeshPoint& a, const gpu::MeshPoint& b) {
    return wide ? std::tie(a.x, a.y) < std::tie(b.x, b.y) : std::tie(a.y, a.x) < std::tie(b.y, b.x);
  });
  const Box first{0, 0, 0, 0, box.first, middle, 0}, second{0, 0, 0, 0, middle, box.last, 0};
  box.halves = static_cast<std::uint32_t>(boxes_.size());
  boxes_.push_back(first);
  boxes_.push_back(second);
}

gpu::Corner LooseSamples::corner(const gpu::MeshPoint& p) const {
  const double height_m = p.height * proto::kHeightStep_m;
  const proto::RowFrame row = proto::row_frame(lattice_, south_ + p.y);
  const proto::Vec3 at = proto::ecef(row, proto::column_frame(lattice_, west_ + p.x), height_m);
  return {p.x, p.y, height_m, at, tile_.ecef_steps.rounded(at, height_m), row};
}

LooseSamples::Farthest LooseSamples::farthest(const std::array<gpu::MeshPoint, 3>& corners) const {
  Farthest found;
  if (samples_.empty()) return found;
  const gpu::Corner three[3] = {corner(corners[0]), corner(corners[1]), corner(corners[2])};
  const gpu::MeasuredTriangle triangle = gpu::measured_triangle(tile_, three, 0);
  const double graze =
      gpu::kGrace_m + graze_m(triangle, proto::normal(three[0].row, proto::column_frame(lattice_, west_ + corners[0].x)));
  const auto& plan = triangle.plan;
  std::vector<std::uint32_t> open{0};
  while (!open.empty()) {
    const Box& box = boxes_[open.back()];
    open.pop_back();
    const bool beside = box.west > plan.columns.last || box.east < plan.columns.first || box.south > plan.rows.last ||
                        box.north < plan.rows.first;
    if (beside || std::any_of(std::begin(plan.edge), std::end(plan.edge), [&](const gpu::PlanEdge& e) {
          return most_left_of(e, box.west, box.south, box.east, box.north) < -e.slack;
        }))
      continue;
    if (box.halves != 0) {
      open.push_back(box.halves);
      open.push_back(box.halves + 1);
      continue;
    }
    for (std::uint32_t k = box.first; k < box.last; ++k) see(triangle, graze, corners, samples_[k], found);
  }
  return found;
}

void LooseSamples::see(const gpu::MeasuredTriangle& t, double graze_m, const std::array<gpu::MeshPoint, 3>& corners,
                       const gpu::MeshPoint& p, Farthest& found) const {
  bool inside = true;
  for (const gpu::PlanEdge& e : t.plan.edge) {
    const std::int64_t left = e.dx * (p.y - e.y) - e.dy * (p.x - e.x);
    if (left < -e.slack) return;
    inside = inside && left >= 0;
  }
  if (!inside && !t.plan.slack) return;
  const proto::RowFrame row = proto::row_frame(lattice_, south_ + p.y);
  const proto::ColumnFrame column = proto::column_frame(lattice_, west_ + p.x);
  const double height_m = p.height * proto::kHeightStep_m;
  double error_m = 0;
  if (!inside) {
    error_m = t.error_beyond(row, column, height_m);
  } else {
    if (t.exact.shows())
      error_m = std::abs(t.exact_range.clamp(gpu::PlaneRow(t.exact, row).height_m(column.sin_lon, column.cos_lon)) - height_m);
    if (t.rounded.shows())
      error_m = std::max(
          error_m,
          std::abs(t.rounded_range.clamp(gpu::PlaneRow(t.rounded, row).height_m(column.sin_lon, column.cos_lon)) - height_m));
  }
  if (error_m > 0) error_m += graze_m;
  found.error_m = std::max(found.error_m, error_m);
  const bool border = p.x == 0 || p.y == 0 || p.x == tile_.side || p.y == tile_.side;
  const bool corner =
      std::any_of(corners.begin(), corners.end(), [&](const gpu::MeshPoint& c) { return c.x == p.x && c.y == p.y; });
  if (!inside || border || corner) return;
  // Which of equal ones must not depend on the order they are in.
  if (error_m > found.inside_m || (error_m == found.inside_m && std::tie(p.y, p.x) < std::tie(found.inside.y, found.inside.x))) {
    found.inside = p;
    found.inside_m = error_m;
  }
}

}  // namespace cordillera::pipeline
