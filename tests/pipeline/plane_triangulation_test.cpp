// The triangulation of quantized-mesh's squares: what holds of every one, and lines that must be in it.
#include "pipeline/faces/quantized_mesh/plane_triangulation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <set>

namespace cordillera::pipeline::faces {
namespace {

using Point = PlaneTriangulation::Point;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

std::int64_t twice_area(const Point& a, const Point& b, const Point& c) {
  return std::int64_t{b.x - a.x} * (c.y - a.y) - std::int64_t{b.y - a.y} * (c.x - a.x);
}

/// The determinant that is positive where d lies within the circle through a, b and c, which are counter-clockwise. In 128 bits
/// it is exact.
bool is_in_circle(const Point& a, const Point& b, const Point& c, const Point& d) {
  using Wide = __int128;
  const auto row = [&d](const Point& p) {
    const Wide x = p.x - d.x, y = p.y - d.y;
    return std::array<Wide, 3>{x, y, x * x + y * y};
  };
  const auto [ax, ay, aa] = row(a);
  const auto [bx, by, bb] = row(b);
  const auto [cx, cy, cc] = row(c);
  return ax * (by * cc - bb * cy) - ay * (bx * cc - bb * cx) + aa * (bx * cy - by * cx) > 0;
}

enum class Lines { none, some };

/// Covers the square once, and neighbours know each other. Without lines no corner lies within the circle of a triangle beside
/// it: Delaunay's own definition. Beside lines it need not hold.
void expect_sound(const PlaneTriangulation& plane, std::int32_t size, Lines lines = Lines::none) {
  const auto faces = plane.faces();
  const auto at = [&plane](std::uint32_t vertex) { return plane.point(vertex); };
  std::int64_t area = 0;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const auto& [v, beside, fixed] = faces[f];
    const std::int64_t own = twice_area(at(v[0]), at(v[1]), at(v[2]));
    ASSERT_GT(own, 0) << "triangle " << f;
    area += own;
    for (std::size_t k = 0; k < 3; ++k) {
      const Point a = at(v[k]), b = at(v[(k + 1) % 3]);
      const bool side = (a.x == b.x && (a.x == 0 || a.x == size)) || (a.y == b.y && (a.y == 0 || a.y == size));
      ASSERT_EQ(beside[k] == PlaneTriangulation::kNone, side);
      if (side) continue;
      const auto& other = faces[beside[k]];
      std::size_t back = 0;
      while (back < 3 && !(other.vertex[back] == v[(k + 1) % 3] && other.vertex[(back + 1) % 3] == v[k])) ++back;
      ASSERT_LT(back, 3u) << "the triangle across an edge does not have it";
      EXPECT_EQ(other.beside[back], f);
      EXPECT_EQ(other.fixed[back], fixed[k]);
      if (lines == Lines::none) { EXPECT_FALSE(is_in_circle(at(v[0]), at(v[1]), at(v[2]), at(other.vertex[(back + 2) % 3]))); }
    }
  }
  EXPECT_EQ(area, 2 * std::int64_t{size} * size);
}

std::set<Edge> fixed_edges(const PlaneTriangulation& plane) {
  std::set<Edge> edges;
  for (const auto& face : plane.faces()) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (face.fixed[k]) edges.insert(std::minmax(face.vertex[k], face.vertex[(k + 1) % 3]));
    }
  }
  return edges;
}

TEST(PlaneTriangulation, IsDelaunaysWhateverIsAdded) {
  for (const std::int32_t size : {1, 2, 7, 300, 1 << 20}) {
    PlaneTriangulation plane(size);
    std::mt19937 numbers(static_cast<unsigned>(size));
    std::uniform_int_distribution<std::int32_t> place(0, size);
    for (int k = 0; k < 400; ++k) plane.add({place(numbers), place(numbers)});
    expect_sound(plane, size);
  }
}

TEST(PlaneTriangulation, TakesAGridAndASideWhereAllPointsLieOnCirclesAndLines) {
  PlaneTriangulation plane(32);
  for (std::int32_t y = 0; y <= 32; y += 4) {
    for (std::int32_t x = 0; x <= 32; x += 4) plane.add({x, y});
  }
  for (std::int32_t x = 0; x <= 32; ++x) plane.add({x, 0});
  expect_sound(plane, 32);
  EXPECT_EQ(plane.vertices(), 81u + 24u);
}

TEST(PlaneTriangulation, APointThatIsThereIsTheSameVertex) {
  PlaneTriangulation plane(10);
  EXPECT_EQ(plane.add({0, 0}), 0u);
  EXPECT_EQ(plane.add({10, 10}), 2u);
  const auto middle = plane.add({5, 5});
  EXPECT_EQ(plane.add({5, 5}), middle);
  EXPECT_EQ(plane.vertices(), 5u);
}

TEST(PlaneTriangulation, ALineIsAnEdgeSplitWhereItMeetsVertices) {
  PlaneTriangulation plane(100);
  std::mt19937 numbers(3);
  std::uniform_int_distribution<std::int32_t> place(1, 99);
  for (int k = 0; k < 200; ++k) plane.add({place(numbers), place(numbers)});
  const auto west = plane.add({0, 37}), middle = plane.add({50, 37}), east = plane.add({100, 37});
  plane.connect(west, east);
  expect_sound(plane, 100, Lines::some);
  std::map<std::int32_t, std::uint32_t> along;  // vertices of the line by their x
  for (std::uint32_t v = 0; v < plane.vertices(); ++v) {
    if (plane.point(v).y == 37) along[plane.point(v).x] = v;
  }
  ASSERT_EQ(along.at(50), middle);
  const auto edges = fixed_edges(plane);
  for (auto at = along.begin(); std::next(at) != along.end(); ++at)
    EXPECT_EQ(edges.count(std::minmax(at->second, std::next(at)->second)), 1u) << at->first;
  EXPECT_EQ(edges.size(), along.size() - 1);
}

TEST(PlaneTriangulation, APieceThatAnEarlierLineCrossesIsLeftOut) {
  PlaneTriangulation plane(10);
  const auto west = plane.add({2, 5}), east = plane.add({8, 5}), south = plane.add({5, 2}), north = plane.add({5, 8});
  plane.connect(west, east);
  plane.connect(south, north);
  expect_sound(plane, 10, Lines::some);
  EXPECT_EQ(fixed_edges(plane), std::set<Edge>{std::minmax(west, east)});
}

}  // namespace
}  // namespace cordillera::pipeline::faces
