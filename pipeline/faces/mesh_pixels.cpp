#include "pipeline/faces/mesh_pixels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "gpu/measure/surface_error_plane.h"

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;

/// Pixels, and what is drawn into.
struct Canvas {
  const PixelsInUnits& at;
  double* out;
  std::size_t stride;
};

struct PixelRange {
  std::size_t first = 0, end = 0;
};
PixelRange columns_between(const std::vector<double>& u, double west, double east) {
  const auto first = std::lower_bound(u.begin(), u.end(), west), end = std::upper_bound(first, u.end(), east);
  return {static_cast<std::size_t>(first - u.begin()), static_cast<std::size_t>(end - u.begin())};
}
PixelRange rows_between(const std::vector<double>& v, double north, double south) {
  const auto first = std::lower_bound(v.begin(), v.end(), north, std::greater<>());
  const auto end = std::upper_bound(first, v.end(), south, std::greater<>());
  return {static_cast<std::size_t>(first - v.begin()), static_cast<std::size_t>(end - v.begin())};
}

/// Twice the area left of a triangle's side; a place on the side belongs to both of its triangles, and gets the height of the
/// first.
struct EdgeFunction {
  double u = 0, v = 0, du = 0, dv = 0;
  bool left(double pu, double pv) const { return du * (pv - v) - dv * (pu - u) >= 0; }
};

using Corner = std::array<std::int32_t, 3>;

EdgeFunction side(const Corner& a, const Corner& b) {
  const double u = a[0], v = a[1];
  return {u, v, b[0] - u, b[1] - v};
}

/// Its plane over the ellipsoid, held to what no point of the flat triangle can leave.
struct Slab {
  gpu::Plane plane;
  gpu::HeightRange range;

  Slab(const std::array<Vec3, 3>& at, double low_m, double high_m) : plane(gpu::plane_of(at[0], at[1], at[2])) {
    const Vec3 ab = at[1] - at[0], ac = at[2] - at[0], bc = at[2] - at[1];
    range = gpu::height_range(low_m, high_m, std::max({dot(ab, ab), dot(ac, ac), dot(bc, bc)}), 0);
  }
};

void draw(const std::array<Corner, 3>& corner, const Slab& facet, const Canvas& to) {
  const auto [west, east] = std::minmax({corner[0][0], corner[1][0], corner[2][0]});
  const auto [south, north] = std::minmax({corner[0][1], corner[1][1], corner[2][1]});
  const PixelRange columns = columns_between(to.at.u, west, east);
  if (columns.first == columns.end) return;
  const PixelRange rows = rows_between(to.at.v, north, south);
  const std::array<EdgeFunction, 3> sides = {side(corner[0], corner[1]), side(corner[1], corner[2]), side(corner[2], corner[0])};
  for (std::size_t r = rows.first; r < rows.end; ++r) {
    const gpu::PlaneRow along(facet.plane, to.at.rows[r]);
    for (std::size_t c = columns.first; c < columns.end; ++c) {
      double& pixel = to.out[r * to.stride + c];
      const auto inside = [&](const EdgeFunction& s) { return s.left(to.at.u[c], to.at.v[r]); };
      if (!std::isnan(pixel) || !std::all_of(sides.begin(), sides.end(), inside)) continue;
      pixel = facet.range.clamp(along.height_m(to.at.columns[c].sin_lon, to.at.columns[c].cos_lon));
    }
  }
}

std::vector<Vec3> positions(const LatticeMesh& mesh) {
  const int finer = std::countr_zero(static_cast<std::uint32_t>(mesh.side / proto::kTileCells));
  const proto::Lattice lattice{mesh.z + finer};
  const proto::TileAddress tile{mesh.z, mesh.x, mesh.y};
  std::vector<Vec3> at;
  at.reserve(mesh.points.size());
  for (const auto& [u, v, h] : mesh.points) {
    const proto::RowFrame row = proto::row_frame(lattice, lattice.south(tile) + v);
    at.push_back(proto::ecef(row, proto::column_frame(lattice, lattice.west(tile) + u), h * mesh.height_step));
  }
  return at;
}

PixelsInUnits places(const LatticeMesh& mesh, const PixelRows& rows, const PixelColumns& columns) {
  PixelsInUnits at{{}, {}, rows.frame, columns.frame};
  const double units_a_degree = mesh.side * std::ldexp(1, mesh.z) / 180;
  const double west = static_cast<double>(mesh.x) * mesh.side, south = static_cast<double>(mesh.y) * mesh.side;
  for (const double longitude : columns.longitude_deg) at.u.push_back((longitude + 180) * units_a_degree - west);
  for (const double latitude : rows.latitude_deg) at.v.push_back((latitude + 90) * units_a_degree - south);
  return at;
}

}  // namespace

proto::RowFrame row_frame_at(double latitude_deg) {
  const double e2 = proto::kFlattening * (2 - proto::kFlattening);
  const double sin = std::sin(latitude_deg * std::numbers::pi / 180), cos = std::cos(latitude_deg * std::numbers::pi / 180);
  const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * sin * sin);
  return {sin, cos, n * cos, n * (1 - e2) * sin};
}

proto::ColumnFrame column_frame_at(double longitude_deg) {
  const double radians = longitude_deg * std::numbers::pi / 180;
  return {std::sin(radians), std::cos(radians)};
}

void draw_mesh(const LatticeMesh& mesh, const PixelRows& rows, const PixelColumns& columns, double* out, std::size_t stride) {
  draw_mesh(mesh, places(mesh, rows, columns), out, stride);
}

void draw_mesh(const LatticeMesh& mesh, const PixelsInUnits& pixels, double* out, std::size_t stride) {
  const Canvas to{pixels, out, stride};
  const std::vector<Vec3> at = positions(mesh);
  for (const Triangle& t : mesh.triangles) {
    const std::array<Corner, 3> corner = {mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]};
    const auto [low, high] = std::minmax({corner[0][2], corner[1][2], corner[2][2]});
    draw(corner, Slab({at[t[0]], at[t[1]], at[t[2]]}, low * mesh.height_step, high * mesh.height_step), to);
  }
}

}  // namespace cordillera::pipeline::faces
