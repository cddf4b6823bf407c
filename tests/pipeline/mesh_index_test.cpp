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
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

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
double latitude(const LatticeMesh& mesh, double v) { return (mesh.y - 2) * 45 + latitude(v); }

/// A tile of 45 degrees up to the north pole, which is one point in a hollow: of its 33 vertices triangles to two of three others
/// are lines.
LatticeMesh hollow_at_pole() {
  LatticeMesh mesh;
  mesh.z = 2, mesh.x = 5, mesh.y = 3;
  mesh.side = 256;
  mesh.height_step = 1;
  mesh.points = {{0, 0, 0}, {256, 0, 0}, {0, 240, 9000}, {100, 248, 3000}, {256, 240, 6000}};
  mesh.triangles = {{0, 1, 3}, {0, 3, 2}, {1, 4, 3}, {2, 3, 5}, {3, 4, 21}};
  for (std::uint32_t k = 0; k <= 32; ++k) {
    mesh.points.push_back({static_cast<std::int32_t>(8 * k), 256, 0});
    if (k < 32) mesh.triangles.push_back({k < 16 ? 3u : 4u, 6 + k, 5 + k});
  }
  return mesh;
}
constexpr std::size_t kNoLines = 5;  // of its triangles

/// Where the normal meets a triangle, by Cramer's rule; none where it passes by.
std::optional<double> met(const LatticeMesh& mesh, std::size_t triangle, double u, double v) {
  std::array<Point, 3> corner;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& p = mesh.points[mesh.triangles[triangle][k]];
    corner[k] = at(longitude(p[0]), latitude(mesh, p[1]), p[2]);
  }
  const Point foot = at(longitude(u), latitude(mesh, v), 0), up = up_at(longitude(u), latitude(mesh, v));
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

// Over the pole's row plan has triangles that are lines in space, and a walk from them leads nowhere.
TEST(MeshIndex, height_beside_a_pole_is_of_the_triangle_that_the_normal_meets) {
  const LatticeMesh mesh = hollow_at_pole();
  const MeshIndex index(mesh);
  int inside = 0, over_lines = 0;
  for (double v = 236.25; v < 256; v += 0.25) {
    for (double u = 2.5; u < 256; u += 3) {
      for (std::size_t triangle = 0; triangle < kNoLines; ++triangle) {
        const auto expected = met(mesh, triangle, u, v);
        if (!expected) continue;
        const auto found = index.height_m(longitude(u), latitude(mesh, v));
        ASSERT_TRUE(found);
        EXPECT_NEAR(*found, *expected, 0.001) << u << ", " << v;
        ++inside;
        over_lines += index.triangle_at(u, v).value_or(0) >= kNoLines ? 1 : 0;
      }
    }
  }
  EXPECT_GT(inside, 5000);
  EXPECT_GT(over_lines, 2000);
  EXPECT_NEAR(index.height_m(60, 90).value_or(NAN), 0, 0.001);
}

/// Data may be a small spot of a coarse tile: a question looks at few triangles all the same.
TEST(MeshIndex, ASmallSpotIsCutIntoCells) {
  constexpr std::int32_t kSide = 40, kAt = 70'000;
  LatticeMesh mesh;
  mesh.z = 2, mesh.x = 5, mesh.y = 2;
  mesh.side = 256 << 10;
  mesh.height_step = 1;
  for (std::int32_t row = 0; row <= kSide; ++row) {
    for (std::int32_t column = 0; column <= kSide; ++column) mesh.points.push_back({kAt + column, kAt + 2 * row, 0});
  }
  for (std::uint32_t row = 0; row < kSide; ++row) {
    for (std::uint32_t column = 0; column < kSide; ++column) {
      const std::uint32_t a = row * (kSide + 1) + column, b = a + kSide + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  const MeshIndex index(mesh);
  EXPECT_LT(index.most_in_a_cell(), 20u);
  EXPECT_EQ(index.triangle_at(kAt + 7.75, kAt + 2 * 3 + 0.5), 2u * (3 * kSide + 7));
  EXPECT_FALSE(index.triangle_at(kAt - 1, kAt + 1));
  EXPECT_FALSE(index.triangle_at(0, 0));
  EXPECT_FALSE(index.triangle_at(mesh.side, mesh.side));
}

}  // namespace
}  // namespace cordillera::pipeline::faces
