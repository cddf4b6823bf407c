#include "pipeline/composed_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/overlay.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;
using proto::Vec3;

// No two surfaces of the earth are farther apart; also what a plane gets that stands upright somewhere.
constexpr double kFarthest_m = 2 * proto::kSemiMajor_m;
// The bound of the curvature is of second order; this covers what it leaves out.
constexpr double kMargin = 1.5;

// A place on the ellipsoid and which way is up there.
struct Place {
  Vec3 at, up;
  double tan_lat = 0;
};

struct Plane {
  Vec3 origin, normal;  // normal not of unit length
};

// What one surface does over a place.
struct Over {
  double height_m = 0;
  Vec3 slope;  // rise per metre, in the tangent plane
  bool upright = false;
};

class Ground {
 public:
  Ground(const proto::Lattice& lattice, const proto::TileAddress& tile)
      : lattice_(lattice),
        west_(lattice.west(tile)),
        south_(lattice.south(tile)),
        cell_rad_(2 * kPi / static_cast<double>(lattice.columns())) {}

  // Between lattice vertices by the addition theorems from the vertex to the south-west: no library function of the fraction.
  Place place(PlanPoint p) const {
    const double column = std::floor(p.x), row = std::floor(p.y);
    const proto::ColumnFrame c = proto::column_frames(lattice_, west_ + static_cast<std::int64_t>(column), 1).front();
    const proto::RowFrame r = proto::row_frames(lattice_, south_ + static_cast<std::int64_t>(row), 1).front();
    proto::ColumnFrame here_c;
    proto::RowFrame here_r = r;
    turn(c.sin_lon, c.cos_lon, (p.x - column) * cell_rad_, here_c.sin_lon, here_c.cos_lon);
    if (p.y > row) {
      turn(r.sin_lat, r.cos_lat, (p.y - row) * cell_rad_, here_r.sin_lat, here_r.cos_lat);
      const double e2 = proto::kFlattening * (2 - proto::kFlattening);
      const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * here_r.sin_lat * here_r.sin_lat);
      here_r.radius_m = n * here_r.cos_lat;
      here_r.axis_m = n * (1 - e2) * here_r.sin_lat;
    }
    const double tan_lat = std::abs(here_r.sin_lat) / std::max(here_r.cos_lat, 1e-6);
    return {proto::ecef(here_r, here_c, 0), proto::normal(here_r, here_c), tan_lat};
  }

  std::vector<Vec3> positions(const TileMesh& mesh) const {
    std::vector<Vec3> all(mesh.vertices());
    for (std::size_t v = 0; v < all.size(); ++v) {
      const auto c = proto::column_frames(lattice_, west_ + mesh.x[v], 1).front();
      const auto r = proto::row_frames(lattice_, south_ + mesh.y[v], 1).front();
      all[v] = proto::ecef(r, c, mesh.height[v] * proto::kHeightStep_m);
    }
    return all;
  }

 private:
  static constexpr double kPi = 3.14159265358979323846;

  // a + d for d of at most one cell (0.013 rad at the coarsest lattice): the series ends below 1e-16.
  static void turn(double sin_a, double cos_a, double d, double& sin_sum, double& cos_sum) {
    const double d2 = d * d;
    const double sin_d = d * (1 - d2 / 6 * (1 - d2 / 20 * (1 - d2 / 42)));
    const double cos_d = 1 - d2 / 2 * (1 - d2 / 12 * (1 - d2 / 30));
    sin_sum = sin_a * cos_d + cos_a * sin_d;
    cos_sum = cos_a * cos_d - sin_a * sin_d;
  }

  const proto::Lattice& lattice_;
  std::int64_t west_, south_;
  double cell_rad_;
};

Plane plane_of(const std::vector<Vec3>& at, const std::array<std::uint32_t, 3>& t) {
  return {at[t[0]], cross(at[t[1]] - at[t[0]], at[t[2]] - at[t[0]])};
}

// On a pole row two corners are one point: such a triangle shows nothing.
bool has_area(const Plane& plane) { return dot(plane.normal, plane.normal) > 1e-6; }

Over over(const Plane& plane, const Place& place) {
  const double rise = dot(plane.normal, place.up);
  // Half a degree from upright counts as upright: no terrain is, only triangles over a good part of the globe.
  if (rise <= 0 || rise * rise < 1e-4 * dot(plane.normal, plane.normal)) return {0, {}, true};
  const double height_m = dot(plane.normal, plane.origin - place.at) / rise;
  return {height_m, place.up - (1 / rise) * plane.normal, false};
}

// The largest distance of two planes over their common ground.
//
// Along a line on the ground, the height of a plane over a sphere of radius R curves by (1 + 2 s^2) / R, s its slope: in the
// difference of two planes the first term cancels. Lines of the lattice are no great circles (a parallel turns by tan(lat) / R a
// metre), which brings in the difference of the slopes. A function that curves by c at most is within c d^2 / 6 of the linear one
// between the corners of a triangle of diameter d.
double apart_m(const Plane& a, const Plane& b, const Common& ground, const Ground& on) {
  double most = 0, steepest2 = 0, turning = 0, bent = 0, diameter2 = 0;
  std::array<Vec3, 9> corner;
  for (int k = 0; k < ground.count; ++k) {
    const Place place = on.place(ground.corner[k]);
    const Over first = over(a, place), second = over(b, place);
    if (first.upright || second.upright) return kFarthest_m;
    most = std::max(most, std::abs(first.height_m - second.height_m));
    const Vec3 difference = first.slope - second.slope;
    const double bend = std::sqrt(dot(difference, difference));
    bent = std::max(bent, bend);
    steepest2 = std::max({steepest2, dot(first.slope, first.slope), dot(second.slope, second.slope)});
    turning = std::max(turning, bend * place.tan_lat);
    corner[k] = place.at;
    for (int j = 0; j < k; ++j) diameter2 = std::max(diameter2, dot(place.at - corner[j], place.at - corner[j]));
  }
  const double radius_m = proto::kSemiMajor_m * (1 - 2 * proto::kFlattening);  // the least radius of curvature there is, about
  const double share = kMargin * diameter2 / (6 * radius_m);
  // Around a pole parallels turn without limit, but no surface departs by more than its slope times the way.
  const double turned = std::min(turning * share, bent * std::sqrt(diameter2));
  return std::min(kFarthest_m, most + (2 * steepest2 + most / radius_m) * share + turned);
}

}  // namespace

double composed_error_m(const ComposedErrorInput& input) {
  const Ground ground(*input.lattice, input.tile);
  const TileMesh &welded = *input.welded, &parent = *input.parent;
  const std::vector<Vec3> at_welded = ground.positions(welded), at_parent = ground.positions(parent);
  const TriangleIndex index(parent);
  std::vector<std::uint32_t> near;
  double most = 0;
  for (const auto& t : welded.triangles) {
    if (!is_published(welded, t)) continue;
    const auto plan = plan_of(welded, t);
    const Plane plane = plane_of(at_welded, t);
    if (!has_area(plane)) continue;
    index.meeting(plan, near);
    for (const std::uint32_t k : near) {
      const Plane other = plane_of(at_parent, parent.triangles[k]);
      const Common common = common_part(plan, plan_of(parent, parent.triangles[k]));
      if (common.count > 2 && has_area(other)) most = std::max(most, apart_m(plane, other, common, ground));
    }
  }
  return most;
}

}  // namespace cordillera::pipeline
