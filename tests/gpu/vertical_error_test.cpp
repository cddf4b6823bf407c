// The judge of simplified meshes, held against surfaces whose error is known.
#include "gpu/fit/vertical_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace cordillera::gpu {
namespace {

using proto::TriangleMesh;

PointsXyz points_of(const TriangleMesh& mesh) { return {mesh.x, mesh.y, mesh.z}; }

/// side x side vertices over a square, z of the place.
template <class Height>
TriangleMesh grid(int side, double cell, double offset, const Height& height) {
  TriangleMesh mesh;
  for (int r = 0; r < side; ++r) {
    for (int c = 0; c < side; ++c) {
      mesh.x.push_back(offset + c * cell);
      mesh.y.push_back(offset + r * cell);
      mesh.z.push_back(height(c, r));
    }
  }
  const auto at = [side](int c, int r) { return static_cast<std::uint32_t>(r * side + c); };
  for (int r = 0; r + 1 < side; ++r) {
    for (int c = 0; c + 1 < side; ++c) {
      mesh.triangles.push_back({at(c, r), at(c + 1, r), at(c + 1, r + 1)});
      mesh.triangles.push_back({at(c, r), at(c + 1, r + 1), at(c, r + 1)});
    }
  }
  return mesh;
}

/// A square of two triangles around all of it.
TriangleMesh square(double low, double high, double z) {
  TriangleMesh mesh;
  mesh.x = {low, high, high, low};
  mesh.y = {low, low, high, high};
  mesh.z = {z, z, z, z};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

double rough(int c, int r) { return std::sin(c * 12.9898 + r * 78.233) * 10; }

TEST(VerticalError, OfAMeshAgainstItselfIsNothing) {
  for (const double offset : {0.0, 5e6 / 3}) {
    const TriangleMesh mesh = grid(40, 0.7, offset, rough);
    const VerticalError error = vertical_error(mesh, points_of(mesh));
    EXPECT_EQ(error.measured, 1600u);
    EXPECT_EQ(error.uncovered, 0u);
    EXPECT_LT(error.max, 1e-8);
  }
}

TEST(VerticalError, IsHandMade) {
  TriangleMesh points;
  points.x = {1, 2, 3, 4};
  points.y = {1, 3, 2, 1};
  points.z = {7, 3, 5, 6};
  const VerticalError error = vertical_error(square(0, 5, 5), points_of(points));
  EXPECT_EQ(error.measured, 4u);
  EXPECT_DOUBLE_EQ(error.rmse, std::sqrt((4 + 4 + 0 + 1) / 4.0));
  EXPECT_DOUBLE_EQ(error.max, 2);
  EXPECT_EQ(error.worst, 0u);
}

TEST(VerticalError, FollowsASlope) {
  const auto slope = [](double x, double y) { return 3 * x - 2 * y; };
  TriangleMesh surface = square(-1, 30, 0);
  for (std::size_t v = 0; v < 4; ++v) surface.z[v] = slope(surface.x[v], surface.y[v]);
  const TriangleMesh points = grid(29, 1, 0, [&](int c, int r) { return slope(c, r) + (c == 7 && r == 9 ? 0.5 : 0); });
  const VerticalError error = vertical_error(surface, points_of(points));
  EXPECT_NEAR(error.max, 0.5, 1e-12);
  EXPECT_EQ(error.worst, 9u * 29 + 7);
}

TEST(VerticalError, CountsPointsBesideTheSurface) {
  const TriangleMesh points = grid(11, 1, 0, [](int, int) { return 1.0; });
  const VerticalError error = vertical_error(square(0, 5, 0), points_of(points));
  EXPECT_EQ(error.measured, 36u);
  EXPECT_EQ(error.uncovered, 121u - 36u);
  EXPECT_EQ(error.rmse, 1) << "points beside it have no error";
}

TEST(VerticalError, AFoldCountsWithItsFartherSheet) {
  TriangleMesh surface = square(0, 5, 0);
  TriangleMesh upper = square(0, 5, 3);
  for (auto& triangle : upper.triangles) {
    std::swap(triangle[0], triangle[1]);  // upside down as well
    for (auto& corner : triangle) corner += 4;
  }
  for (auto [to, from] : {std::pair{&surface.x, &upper.x}, {&surface.y, &upper.y}, {&surface.z, &upper.z}}) {
    to->insert(to->end(), from->begin(), from->end());
  }
  surface.triangles.insert(surface.triangles.end(), upper.triangles.begin(), upper.triangles.end());
  const TriangleMesh points = grid(4, 1, 1, [](int, int) { return 1.0; });
  EXPECT_EQ(vertical_error(surface, points_of(points)).max, 2);
  std::reverse(surface.triangles.begin(), surface.triangles.end());
  EXPECT_EQ(vertical_error(surface, points_of(points)).max, 2) << "whichever comes first";
}

TEST(VerticalError, UpsideDownIsTheSamePlace) {
  TriangleMesh surface = grid(8, 7, 0, rough);
  const TriangleMesh points = grid(50, 1, 0, rough);
  const double upright = vertical_error(surface, points_of(points)).rmse;
  for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_NEAR(vertical_error(surface, points_of(points)).rmse, upright, 1e-12);
}

TEST(VerticalError, RoundingLosesNoPointOfASlantedBorder) {
  // A border along (3, 1): its inner points are on it only up to rounding.
  TriangleMesh surface;
  surface.x = {0.1, 300.1, 200.1};
  surface.y = {0.2, 100.2, 400.2};
  surface.z = {0, 3000, 0};
  surface.triangles = {{0, 1, 2}};
  TriangleMesh points;
  for (int k = 0; k <= 999; ++k) {
    points.x.push_back(0.1 + 300.0 * k / 999);
    points.y.push_back(0.2 + 100.0 * k / 999);
    points.z.push_back(3000.0 * k / 999);
  }
  const VerticalError error = vertical_error(surface, points_of(points));
  EXPECT_EQ(error.uncovered, 0u);
  EXPECT_LT(error.max, 0.01);
}

TEST(VerticalError, SharesChangeNothing) {
  const TriangleMesh points = grid(50, 1, 0, rough);
  const TriangleMesh surface = grid(8, 7, 0, rough);
  const VerticalError one = vertical_error(surface, points_of(points));
  const VerticalError five = vertical_error(surface, points_of(points), 5);
  const VerticalError many = vertical_error(surface, points_of(points), 100000);
  EXPECT_GT(one.rmse, 1);
  EXPECT_EQ(one.measured, 2500u);
  for (const VerticalError& other : {five, many}) {
    EXPECT_EQ(one.rmse, other.rmse);
    EXPECT_EQ(one.max, other.max);
    EXPECT_EQ(one.worst, other.worst);
    EXPECT_EQ(one.uncovered, other.uncovered);
  }
}

/// Every triangle tried for every point.
TEST(VerticalError, AgreesWithTryingEverything) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(0.01, 48.9);
  const TriangleMesh surface = grid(8, 7, 0, rough);
  TriangleMesh points;
  for (int k = 0; k < 500; ++k) {
    points.x.push_back(place(random));
    points.y.push_back(place(random));
    points.z.push_back(place(random));
  }
  double worst = 0;
  for (std::size_t p = 0; p < 500; ++p) {
    // In its cell of the grid the place above or below the diagonal decides.
    const int c = static_cast<int>(points.x[p] / 7), r = static_cast<int>(points.y[p] / 7);
    const double u = points.x[p] / 7 - c, v = points.y[p] / 7 - r;
    const double z = u > v ? rough(c, r) * (1 - u) + rough(c + 1, r) * (u - v) + rough(c + 1, r + 1) * v
                           : rough(c, r) * (1 - v) + rough(c + 1, r + 1) * u + rough(c, r + 1) * (v - u);
    worst = std::max(worst, std::abs(z - points.z[p]));
  }
  const VerticalError error = vertical_error(surface, points_of(points));
  EXPECT_EQ(error.measured, 500u);
  EXPECT_NEAR(error.max, worst, 1e-9);
}

}  // namespace
}  // namespace cordillera::gpu
