// Heights between the vertices of a decoded mesh: of the triangle that the ellipsoid's normal meets.
#include "pipeline/faces/mesh_index.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "pipeline/encode/draco_mesh.h"

namespace cordillera::pipeline::faces {
namespace {

using Point = std::array<double, 3>;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Point cross(const Point& a, const Point& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }

Point up_at(double longitude_deg, double latitude_deg) {
  const double lon = longitude_deg * std::numbers::pi / 180, lat = latitude_deg * std::numbers::pi / 180;
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}

Point at(double longitude_deg, double latitude_deg, double height_m) {
  const Point up = up_at(longitude_deg, latitude_deg);
  const double f = 1 / 298.257223563, e2 = f * (2 - f), n = 6378137 / std::sqrt(1 - e2 * up[2] * up[2]);
  return {(n + height_m) * up[0], (n + height_m) * up[1], (n * (1 - e2) + height_m) * up[2]};
}

/// A tile of 45 degrees, cut from south-west to north-east into two triangles that meet in a sharp valley.
LatticeMesh valley() {
  LatticeMesh mesh;
  mesh.z = 2, mesh.x = 5, mesh.y = 2;
  mesh.side = 256;
  mesh.height_step = 1;
  mesh.points = {{0, 0, 0}, {256, 0, 9000}, {256, 256, 0}, {0, 256, 9000}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

double longitude(double u) { return 45 + u * 45 / 256; }
double latitude(double v) { return v * 45 / 256; }

/// Where the normal meets a triangle, by Cramer's rule; none where it passes by.
std::optional<double> met(const LatticeMesh& mesh, std::size_t triangle, double u, double v) {
  std::array<Point, 3> corner;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& p = mesh.points[mesh.triangles[triangle][k]];
    corner[k] = at(longitude(p[0]), latitude(p[1]), p[2]);
  }
  const Point foot = at(longitude(u), latitude(v), 0), up = up_at(longitude(u), latitude(v));
  const Point ab = minus(corner[1], corner[0]), ac = minus(corner[2], corner[0]), away = minus(foot, corner[0]);
  const double all = dot(up, cross(ab, ac)), b = dot(up, cross(away, ac)) / all, c = dot(up, cross(ab, away)) / all;
  if (b < 0 || c < 0 || b + c > 1) return std::nullopt;
  return -dot(away, cross(ab, ac)) / all;
}

TEST(MeshIndex, height_is_of_the_triangle_that_the_normal_meets) {
  const LatticeMesh mesh = valley();
  const MeshIndex index(mesh);
  int inside = 0, elsewhere = 0;
  for (double v = 3.5; v < 256; v += 5) {
    for (double u = 2.5; u < 256; u += 3) {
      for (const std::size_t triangle : {std::size_t{0}, std::size_t{1}}) {
        const auto expected = met(mesh, triangle, u, v);
        if (!expected) continue;
        ASSERT_TRUE(index.height_m(longitude(u), latitude(v)));
        EXPECT_NEAR(*index.height_m(longitude(u), latitude(v)), *expected, 0.001) << u << ", " << v;
        ++inside;
        elsewhere += index.triangle_at(u, v) == triangle ? 0 : 1;
      }
    }
  }
  EXPECT_GT(inside, 3000);
  EXPECT_GT(elsewhere, 50) << "an edge of 60 degrees is far from the straight line in plan";
}

}  // namespace
}  // namespace cordillera::pipeline::faces
