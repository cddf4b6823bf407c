#include "gpu/measure/upright.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gpu/measure/surface_error_plane.h"

namespace cordillera::gpu {
namespace {

using proto::Vec3;

// Other programs' normals differ in their last bits; a triangle as upright as that is turned over to one of them.
constexpr double kLeastCosine = 1e-9;

bool shows_front(const std::array<Vec3, 3>& p, const std::array<Vec3, 3>& up) {
  const Vec3 normal = proto::cross(p[1] - p[0], p[2] - p[0]);
  const double least2 = kLeastCosine * kLeastCosine * proto::dot(normal, normal);
  return std::all_of(up.begin(), up.end(), [&](const Vec3& u) {
    const double rise = proto::dot(normal, u);
    return rise > 0 && rise * rise > least2;
  });
}

}  // namespace

Upright::Upright(const TilePlace& place)
    : at_(place),
      west_(place.lattice->west(place.tile)),
      south_(place.lattice->south(place.tile)),
      unit_rad_(std::numbers::pi / static_cast<double>(place.lattice->rows())) {
  const std::int64_t rows = place.lattice->rows(), first = std::max<std::int64_t>(south_, 1),
                     last = std::min(south_ + place.side, rows - 1);
  least_cos_ = std::min(proto::row_frame(*place.lattice, first).cos_lat, proto::row_frame(*place.lattice, last).cos_lat);
}

bool Upright::at_pole(const MeshPoint& p) const { return south_ + p.y == 0 || south_ + p.y == at_.lattice->rows(); }

// In units of the lattice, edges leave their lines in plan by less than the square of their length (an angle), heights lean
// towards each other by their difference over the earth's radius, and rounding moves points by a step. Triangles with room for
// that, nearly all there are, need no sines.
bool Upright::cannot_turn(const std::array<MeshPoint, 3>& c) const {
  const auto [west, east] = std::minmax({c[0].x, c[1].x, c[2].x});
  const auto [south, north] = std::minmax({c[0].y, c[1].y, c[2].y});
  const auto [low, high] = std::minmax({c[0].height, c[1].height, c[2].height});
  const double wide = std::max(static_cast<double>(east) - west, static_cast<double>(north) - south);
  if (least_cos_ < 0.05 || wide * unit_rad_ > 0.5) return false;
  const double leaning = (static_cast<double>(high) - low) * proto::kHeightStep_m / proto::kSemiMajor_m;
  const double step_m = at_.ecef_steps.between(low * proto::kHeightStep_m, high * proto::kHeightStep_m);
  const double moved = 2 * wide * (wide * unit_rad_ + leaning) + 4 * step_m / (proto::kSemiMajor_m * unit_rad_);
  return static_cast<double>(twice_area(c[0], c[1], c[2])) * least_cos_ > 2 * wide * moved;
}

bool Upright::is(const std::array<MeshPoint, 3>& corners) const {
  if (std::count_if(corners.begin(), corners.end(), [&](const MeshPoint& p) { return at_pole(p); }) > 1 || cannot_turn(corners))
    return true;
  std::array<Vec3, 3> exact, rounded, up;
  for (std::size_t k = 0; k < 3; ++k) {
    const proto::RowFrame row = proto::row_frame(*at_.lattice, south_ + corners[k].y);
    const proto::ColumnFrame column = proto::column_frame(*at_.lattice, west_ + corners[k].x);
    const double height_m = corners[k].height * proto::kHeightStep_m;
    exact[k] = proto::ecef(row, column, height_m);
    rounded[k] = at_.ecef_steps.rounded(exact[k], height_m);
    up[k] = proto::normal(row, column);
  }
  return shows_front(exact, up) && shows_front(rounded, up);
}

std::vector<std::uint32_t> turned_triangles(const Upright& upright, const proto::TileMesh& mesh) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (!is_published(mesh, mesh.triangles[t])) continue;
    const auto point = [&](std::uint32_t v) { return MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
    if (!upright.is({point(a), point(b), point(c)})) found.push_back(t);
  }
  return found;
}

TriangleError UprightMeter::measure(const std::array<MeshPoint, 3>& corners, double limit_m) const {
  if (upright_.is(corners)) return meter_.measure(corners, limit_m);
  TriangleError error = meter_.measure(corners, -1);  // whatever its error: the points that could become vertices
  error.error_m = INFINITY;
  return error;
}

double UprightMeter::error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const {
  return upright_.is(corners) ? meter_.error_m(corners, asked) : INFINITY;
}

}  // namespace cordillera::gpu
