#include "pipeline/faces/mesh_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "gpu/measure/surface_error_plane.h"

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;

// A few triangles a cell; more cells cost memory and find no faster.
constexpr double kTrianglesACell = 2;
constexpr std::int32_t kMostCells = 512;

struct TriangleCorners {
  std::array<std::array<std::int32_t, 3>, 3> at;
};

TriangleCorners corners_of(const LatticeMesh& mesh, std::uint32_t triangle) {
  const Triangle& t = mesh.triangles[triangle];
  return {{mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]}};
}

/// Not right of any edge: edges belong to both of their triangles.
bool covers(const TriangleCorners& c, double u, double v) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& a = c.at[k];
    const auto& b = c.at[(k + 1) % 3];
    const double ab_u = static_cast<double>(b[0]) - a[0], ab_v = static_cast<double>(b[1]) - a[1];
    if (ab_u * (v - a[1]) - ab_v * (u - a[0]) < 0) return false;
  }
  return true;
}

proto::Lattice lattice_of(const LatticeMesh& mesh) {
  return {mesh.z + std::countr_zero(static_cast<std::uint32_t>(mesh.side / proto::kTileCells))};
}

}  // namespace

MeshIndex::MeshIndex(LatticeMesh mesh) : mesh_(std::move(mesh)) {
  const double wanted = std::sqrt(static_cast<double>(mesh_.triangles.size()) / kTrianglesACell);
  cells_ = std::clamp(static_cast<std::int32_t>(wanted), 1, kMostCells);
  // Over the mesh, not over the tile: data may be a small spot of a coarse one.
  for (std::size_t axis = 0; axis < 2; ++axis) {
    std::int32_t low = mesh_.side, high = 0;
    for (const auto& point : mesh_.points) low = std::min(low, point[axis]), high = std::max(high, point[axis]);
    axes_[axis] = {static_cast<double>(low), std::max(1.0, static_cast<double>(high) - low)};
  }
  const auto each_cell = [&](std::uint32_t triangle, const auto& visit) {
    const TriangleCorners c = corners_of(mesh_, triangle);
    const auto [west, east] = std::minmax({c.at[0][0], c.at[1][0], c.at[2][0]});
    const auto [south, north] = std::minmax({c.at[0][1], c.at[1][1], c.at[2][1]});
    for (std::int32_t row = axes_[1].cell_of(south, cells_); row <= axes_[1].cell_of(north, cells_); ++row)
      for (std::int32_t column = axes_[0].cell_of(west, cells_); column <= axes_[0].cell_of(east, cells_); ++column)
        visit(static_cast<std::size_t>(row) * static_cast<std::size_t>(cells_) + static_cast<std::size_t>(column));
  };
  first_.assign(static_cast<std::size_t>(cells_) * static_cast<std::size_t>(cells_) + 1, 0);
  const auto count = static_cast<std::uint32_t>(mesh_.triangles.size());
  for (std::uint32_t t = 0; t < count; ++t) each_cell(t, [&](std::size_t cell) { ++first_[cell + 1]; });
  for (std::size_t cell = 1; cell < first_.size(); ++cell) first_[cell] += first_[cell - 1];
  triangles_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t t = 0; t < count; ++t) each_cell(t, [&](std::size_t cell) { triangles_[next[cell]++] = t; });
}

std::size_t MeshIndex::bytes() const {
  return mesh_.points.size() * sizeof(mesh_.points[0]) + mesh_.triangles.size() * sizeof(Triangle) +
         (first_.size() + triangles_.size()) * sizeof(std::uint32_t);
}

std::int32_t MeshIndex::Axis::cell_of(double units, std::int32_t cells) const {
  return static_cast<std::int32_t>(std::clamp((units - first) / length * cells, 0.0, cells - 1.0));
}

std::size_t MeshIndex::most_in_a_cell() const {
  std::uint32_t most = 0;
  for (std::size_t cell = 1; cell < first_.size(); ++cell) most = std::max(most, first_[cell] - first_[cell - 1]);
  return most;
}

std::optional<std::uint32_t> MeshIndex::triangle_at(double u, double v) const {
  const auto row = static_cast<std::size_t>(axes_[1].cell_of(v, cells_)),
             column = static_cast<std::size_t>(axes_[0].cell_of(u, cells_));
  const std::size_t cell = row * static_cast<std::size_t>(cells_) + column;
  for (std::uint32_t k = first_[cell]; k < first_[cell + 1]; ++k) {
    if (covers(corners_of(mesh_, triangles_[k]), u, v)) return triangles_[k];
  }
  return std::nullopt;
}

namespace {

/// A place on the ellipsoid and which way is up there.
struct IndexPoint {
  Vec3 foot, up;
  IndexPoint(double longitude_deg, double latitude_deg) {
    const double lon = longitude_deg * std::numbers::pi / 180, lat = latitude_deg * std::numbers::pi / 180;
    const double e2 = proto::kFlattening * (2 - proto::kFlattening);
    const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * std::sin(lat) * std::sin(lat));
    up = {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
    foot = {n * up.x, n * up.y, n * (1 - e2) * up.z};
  }
};

/// A triangle in space.
struct Facet {
  TriangleCorners corner;
  std::array<Vec3, 3> at;
  double low_m = INFINITY, high_m = -INFINITY;

  Facet(const LatticeMesh& mesh, std::uint32_t triangle) : corner(corners_of(mesh, triangle)) {
    const proto::Lattice lattice = lattice_of(mesh);
    const proto::TileAddress tile{mesh.z, mesh.x, mesh.y};
    for (std::size_t k = 0; k < 3; ++k) {
      const double height_m = corner.at[k][2] * mesh.height_step;
      at[k] = proto::ecef(proto::row_frame(lattice, lattice.south(tile) + corner.at[k][1]),
                          proto::column_frame(lattice, lattice.west(tile) + corner.at[k][0]), height_m);
      low_m = std::min(low_m, height_m);
      high_m = std::max(high_m, height_m);
    }
  }

  /// Of the normal's point on the plane, held to what the triangle can have.
  double height_m(const IndexPoint& ground) const {
    const Vec3 ab = at[1] - at[0], ac = at[2] - at[0], bc = at[2] - at[1], across = cross(ab, ac);
    const double rise = dot(across, ground.up);
    if (rise <= 0) return (low_m + high_m) / 2;  // of no width
    const double edge2_m2 = std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)});
    return gpu::height_range(low_m, high_m, edge2_m2, 0).clamp(dot(across, at[0] - ground.foot) / rise);
  }

  /// With two corners at a pole, which are one point: nothing is there to meet.
  bool is_line() const {
    const Vec3 across = cross(at[1] - at[0], at[2] - at[0]);
    return dot(across, across) == 0;
  }

  /// An edge, from corner `edge` to the next, and how far outside of it the normal passes, in metres.
  struct Passed {
    std::size_t edge = 0;
    double beside_m = 0;
  };
  /// The edge that it passes by on the outer side, farthest; none where it meets the triangle.
  std::optional<Passed> passed(const IndexPoint& ground) const {
    std::optional<Passed> farthest;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = at[k] - ground.foot, b = at[(k + 1) % 3] - ground.foot, ab = b - a;
      const double beside_m = -dot(ground.up, cross(a, b)) / length(ab);
      if (beside_m > (farthest ? farthest->beside_m : 0)) farthest = Passed{k, beside_m};
    }
    return farthest;
  }

  /// A point in plan just beyond an edge, as near to (u, v) as may be.
  std::array<double, 2> beyond(std::size_t edge, double u, double v) const {
    constexpr double kBeyond = 1.0 / 64;
    const auto &a = corner.at[edge], &b = corner.at[(edge + 1) % 3];
    const double du = static_cast<double>(b[0]) - a[0], dv = static_cast<double>(b[1]) - a[1], length = std::hypot(du, dv);
    const double inside = (du * (v - a[1]) - dv * (u - a[0])) / length;  // how far (u, v) is from the edge
    return {u + dv / length * (inside + kBeyond), v - du / length * (inside + kBeyond)};
  }
};

}  // namespace

// Beside a pole triangles that are far apart in plan touch in space, and no walk leads from one to the other.
double MeshIndex::height_of_nearest_m(double longitude_deg, double latitude_deg, std::uint32_t below) const {
  const IndexPoint ground(longitude_deg, latitude_deg);
  std::uint32_t nearest = below;
  double least_m = INFINITY;
  for (std::uint32_t t = 0; t < mesh_.triangles.size() && least_m > 0; ++t) {
    const Facet facet(mesh_, t);
    if (facet.is_line()) continue;
    const auto passed = facet.passed(ground);
    const double beside_m = passed ? passed->beside_m : 0;
    if (beside_m >= least_m) continue;
    least_m = beside_m;
    nearest = t;
  }
  return Facet(mesh_, nearest).height_m(ground);
}

std::optional<double> MeshIndex::height_m(double longitude_deg, double latitude_deg) const {
  const double units_a_degree = mesh_.side * std::ldexp(1, mesh_.z) / 180;
  const double u = (longitude_deg + 180) * units_a_degree - static_cast<double>(mesh_.x) * mesh_.side;
  const double v = (latitude_deg + 90) * units_a_degree - static_cast<double>(mesh_.y) * mesh_.side;
  const auto below = triangle_at(u, v);
  if (!below) return std::nullopt;
  // An edge is straight in space and leaves the straight line in degrees: the normal may meet the triangle beside the one that is
  // there in plan.
  constexpr int kMostSteps = 8;
  const IndexPoint ground(longitude_deg, latitude_deg);
  std::uint32_t triangle = *below;
  for (int step = 0; step < kMostSteps; ++step) {
    const Facet facet(mesh_, triangle);
    if (facet.is_line()) break;
    const auto passed = facet.passed(ground);
    if (!passed) return facet.height_m(ground);
    const auto [beside_u, beside_v] = facet.beyond(passed->edge, u, v);
    const auto next = triangle_at(beside_u, beside_v);
    if (!next || *next == triangle) break;
    triangle = *next;
  }
  return height_of_nearest_m(longitude_deg, latitude_deg, *below);
}

}  // namespace cordillera::pipeline::faces
