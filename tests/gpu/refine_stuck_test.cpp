// What refinement leaves over the limit: triangles of the lattice are made there, on sides and rims of a tile, too.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>

#include "gpu/refine/refine.h"
#include "tests/gpu/measured_tile.h"

namespace cordillera::gpu {
namespace {

/// At a place between four samples the surface is right in one triangle of the lattice alone, and no sample near it tells.
class Pixel final : public ErrorMeter {
 public:
  static constexpr std::array<MeshPoint, 3> kRight{{{100, 100, 0}, {101, 100, 0}, {101, 101, 0}}};
  explicit Pixel(const ErrorMeter& samples) : samples_(samples) {}

  TriangleError measure(const std::array<MeshPoint, 3>& corners, double limit_m) const override {
    TriangleError error = samples_.measure(corners, limit_m);
    if (is_wrong(corners)) error.error_m = 1000, error.count = 0;
    return error;
  }
  double error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const override {
    return is_wrong(corners) ? 1000 : samples_.error_m(corners, asked);
  }
  std::optional<std::array<MeshPoint, 3>> wanted(const std::array<MeshPoint, 3>& corners, double) const override {
    if (!is_wrong(corners)) return std::nullopt;
    std::array<MeshPoint, 3> right = kRight;
    for (MeshPoint& p : right) p.height = static_cast<std::int32_t>(std::lround(kHills(p.x, p.y) * 1024));
    return right;
  }
  static bool is_right(const std::array<MeshPoint, 3>& corners) {
    return std::all_of(kRight.begin(), kRight.end(), [&](const MeshPoint& p) {
      return std::any_of(corners.begin(), corners.end(), [&](const MeshPoint& c) { return c.x == p.x && c.y == p.y; });
    });
  }

 private:
  static bool is_wrong(const std::array<MeshPoint, 3>& c) {
    constexpr double kX = 100.6, kY = 100.3;
    for (std::size_t k = 0; k < 3; ++k) {
      const MeshPoint &a = c[k], &b = c[(k + 1) % 3];
      if ((b.x - a.x) * (kY - a.y) - (b.y - a.y) * (kX - a.x) < 0) return false;
    }
    return !is_right(c);
  }
  const ErrorMeter& samples_;
};

TEST(refine_stuck, makes_the_triangle_that_the_lattice_has_where_insertions_do_not_help) {
  const proto::Samples samples = samples_of(kHills);
  for (const int cells : {2, 16, 64}) {
    TileMesh mesh = coarse(samples, cells);
    const TileMesh crude = mesh;
    const SampleMeter at_samples(input_of(crude, samples));
    const Pixel meter(at_samples);
    const double limit_m = cells == 2 ? 200 : 30;
    std::vector<std::uint32_t> all(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    EXPECT_EQ(refine(mesh, meter, limit_m, all, SIZE_MAX).over, 1u) << "no point is offered for it";
    all.resize(mesh.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    EXPECT_EQ(refine_stuck(mesh, meter, limit_m, all).over, 0u) << cells;
    expect_lawful(mesh);
    EXPECT_EQ(over(mesh, samples, limit_m).size(), 0u);
    EXPECT_TRUE(std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
      const auto point = [&](std::uint32_t v) { return MeshPoint{mesh.x[v], mesh.y[v], 0}; };
      return Pixel::is_right({point(t[0]), point(t[1]), point(t[2])});
    }));
  }
}

/// A place that is right only in a triangle with this corner; none: that no triangle may hold.
class Place final : public ErrorMeter {
 public:
  Place(double x, double y, const std::array<MeshPoint, 3>& wanted, std::optional<MeshPoint> corner)
      : x_(x), y_(y), wanted_(wanted), corner_(corner) {}
  TriangleError measure(const std::array<MeshPoint, 3>& corners, double) const override {
    TriangleError error;
    error.error_m = is_wrong(corners) ? 1000 : 0;
    return error;
  }
  double error_m(const std::array<MeshPoint, 3>& corners, const Glance&) const override { return is_wrong(corners) ? 1000 : 0; }
  std::optional<std::array<MeshPoint, 3>> wanted(const std::array<MeshPoint, 3>& corners, double) const override {
    return is_wrong(corners) ? std::optional(wanted_) : std::nullopt;
  }

 private:
  bool is_wrong(const std::array<MeshPoint, 3>& c) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const MeshPoint &a = c[k], &b = c[(k + 1) % 3];
      if ((b.x - a.x) * (y_ - a.y) - (b.y - a.y) * (x_ - a.x) < 0) return false;
    }
    return std::none_of(c.begin(), c.end(),
                        [&](const MeshPoint& p) { return corner_ && p.x == corner_->x && p.y == corner_->y; });
  }
  const double x_, y_;
  const std::array<MeshPoint, 3> wanted_;
  const std::optional<MeshPoint> corner_;
};

// The neighbour has the side's vertices, too, so none is put in there.
TEST(refine_stuck, makes_a_triangle_on_a_side_with_the_vertices_that_the_side_has) {
  const proto::Samples samples = samples_of([](int, int) { return 0.0; });
  TileMesh mesh = coarse(samples, 8);
  const TileMesh crude = mesh;
  const MeshPoint inside{101, 1, 0};
  const Place meter(100.6, 0.3, {{{100, 0, 0}, {101, 0, 0}, inside}}, inside);
  std::vector<std::uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, all).over, 0u);
  expect_lawful(mesh);
  const auto on_south = [](const TileMesh& m) { return std::count(m.y.begin(), m.y.end(), 0); };
  EXPECT_EQ(on_south(mesh), on_south(crude));
  EXPECT_EQ(mesh.vertices(), crude.vertices() + 1);
  EXPECT_TRUE(std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    return std::count_if(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.y[v] == 0; }) == 2 &&
           std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.x[v] == 101 && mesh.y[v] == 1; });
  }));
}

TEST(refine_stuck, says_which_points_of_a_side_it_would_need_and_uses_them_once_they_are_vertices) {
  const proto::Samples samples = samples_of([](int, int) { return 0.0; });
  TileMesh mesh = coarse(samples, 8);
  const MeshPoint needed{100, 0, 0}, beside{101, 0, 0}, inside{101, 1, 0};
  std::vector<std::uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0U);
  // With the vertices that the side has, the triangle is there already.
  EXPECT_EQ(refine_stuck(mesh, Place(100.6, 0.3, {{needed, beside, inside}}, inside), 30, all).over, 0u);
  all.resize(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0U);
  const Place meter(100.6, 0.3, {{needed, beside, inside}}, needed);
  const Refined stuck = refine_stuck(mesh, meter, 30, all);
  EXPECT_EQ(stuck.over, 1u);
  const auto is_needed = [&](const MeshPoint& p) {
    return std::any_of(stuck.on_sides.begin(), stuck.on_sides.end(),
                       [&](const MeshPoint& q) { return q.x == p.x && q.y == p.y; });
  };
  EXPECT_TRUE(is_needed(needed) && is_needed(beside));
  const std::size_t before = mesh.vertices();
  EXPECT_TRUE(split_side(mesh, needed));
  EXPECT_TRUE(split_side(mesh, beside));
  EXPECT_EQ(mesh.vertices(), before + 2);
  expect_lawful(mesh);
  EXPECT_FALSE(split_side(mesh, needed)) << "it is a vertex";
  EXPECT_FALSE(split_side(mesh, {100, 1, 0})) << "it is on no side";
  all.resize(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, all).over, 0u);
  expect_lawful(mesh);
}

TEST(split_side, cuts_no_side_without_data_or_room) {
  TileMesh mesh;
  mesh.side = kSide;
  const auto add = [&](int x, int y, std::uint8_t mark) {
    mesh.x.push_back(x), mesh.y.push_back(y), mesh.height.push_back(0), mesh.mark.push_back(mark);
  };
  for (const auto& [x, y] : {std::pair{0, 0}, {kSide, 0}, {kSide, kSide}, {0, kSide}}) add(x, y, 0);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  TileMesh empty = mesh;
  empty.mark[1] = proto::kVoid;
  EXPECT_FALSE(split_side(empty, {7, 0, 0}));
  std::uint32_t cuts = 0;
  while (cuts < kSide - 1 && split_side(mesh, {kSide - 1 - static_cast<int>(cuts), 0, 0})) ++cuts;
  EXPECT_GT(cuts, kRefinedCorner - 3) << "the corner opposite has three neighbours already, and edges are turned";
  EXPECT_LT(cuts, kSide - 1u) << "but not for ever";
  const TileMesh full = mesh;
  EXPECT_FALSE(split_side(mesh, {kSide - 1 - static_cast<int>(cuts), 0, 0}));
  EXPECT_EQ(mesh.triangles, full.triangles);
  EXPECT_EQ(mesh.vertices(), 4 + cuts);
  expect_lawful(mesh);
}

/// A mesh of few vertices, all at height 0.
TileMesh mesh_of(std::initializer_list<std::pair<int, int>> places, std::vector<std::array<std::uint32_t, 3>> triangles) {
  TileMesh mesh;
  mesh.side = kSide;
  for (const auto& [x, y] : places) mesh.x.push_back(x), mesh.y.push_back(y), mesh.height.push_back(0), mesh.mark.push_back(0);
  mesh.triangles = std::move(triangles);
  return mesh;
}
std::int64_t twice_area_of(const TileMesh& mesh) {
  std::int64_t sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::int64_t area = std::int64_t{mesh.x[b] - mesh.x[a]} * (mesh.y[c] - mesh.y[a]) -
                              std::int64_t{mesh.y[b] - mesh.y[a]} * (mesh.x[c] - mesh.x[a]);
    EXPECT_GT(area, 0);
    sum += area;
  }
  return sum;
}
std::uint32_t neighbours_of(const TileMesh& mesh, std::uint32_t v) {
  std::set<std::uint32_t> all;
  for (const auto& t : mesh.triangles) {
    if (std::find(t.begin(), t.end(), v) != t.end()) all.insert(t.begin(), t.end());
  }
  return static_cast<std::uint32_t>(all.size() - 1);
}

/// A fan around a vertex inside: its first neighbours are at a and b, the others on a half circle above them.
TileMesh fan_above_a_side(std::uint32_t neighbours) {
  TileMesh mesh = mesh_of({{128, 64}, {28, 0}, {228, 0}}, {{1, 2, 0}});
  for (std::uint32_t k = 1; k + 1 < neighbours; ++k) {
    const double angle = 3.14159265358979323846 * k / (neighbours - 1);
    mesh.x.push_back(128 + static_cast<int>(std::lround(100 * std::cos(angle))));
    mesh.y.push_back(64 + static_cast<int>(std::lround(100 * std::sin(angle))));
    mesh.height.push_back(0), mesh.mark.push_back(0);
  }
  const auto last = static_cast<std::uint32_t>(mesh.vertices() - 1);
  mesh.triangles.push_back({2, 3, 0});
  for (std::uint32_t v = 3; v < last; ++v) mesh.triangles.push_back({v, v + 1, 0});
  mesh.triangles.push_back({last, 1, 0});
  return mesh;
}

// Where a wall runs along a side of tiles, corners beside it are full: without room a pixel was 0.7 m off for 0.15.
TEST(split_side, cuts_a_side_beside_a_full_vertex_where_an_edge_can_be_turned) {
  TileMesh mesh = fan_above_a_side(kMostValence);
  const std::uint32_t around = 6;  // with both beside it as high as the vertex: turning their edge changes nothing
  for (std::uint32_t v = 3; v < mesh.vertices(); ++v)
    mesh.height[v] = v + 1 >= around && v <= around + 1 ? 0 : 1000 + 100 * (v % 2);
  for (std::uint32_t v = 1; v <= 2; ++v) mesh.height[v] = 500;
  const std::int64_t area = twice_area_of(mesh);
  ASSERT_EQ(neighbours_of(mesh, 0), kMostValence);
  ASSERT_TRUE(split_side(mesh, {100, 0, 7}));
  EXPECT_EQ(neighbours_of(mesh, 0), kMostValence);
  EXPECT_EQ(twice_area_of(mesh), area);
  EXPECT_TRUE(std::none_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    return std::count(t.begin(), t.end(), 0u) + std::count(t.begin(), t.end(), around) == 2;
  }));
}

// Of a tile whose first vertex had too many neighbours from the start no triangle was made.
TEST(refine_stuck, makes_a_triangle_where_another_vertex_is_crowded) {
  TileMesh mesh = fan_above_a_side(kMostValence + 2);
  const auto first = static_cast<std::uint32_t>(mesh.vertices());
  const TileMesh square = mesh_of({{10, 200}, {12, 200}, {12, 202}, {10, 202}}, {{0, 1, 3}, {1, 2, 3}});
  for (std::uint32_t v = 0; v < 4; ++v) {
    mesh.x.push_back(square.x[v]), mesh.y.push_back(square.y[v]);
    mesh.height.push_back(0), mesh.mark.push_back(0);
  }
  const auto at = static_cast<std::uint32_t>(mesh.triangles.size());
  for (const auto& [a, b, c] : square.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  const MeshPoint middle{11, 201, 0};
  const Place meter(10.8, 200.5, {{{10, 200, 0}, {11, 200, 0}, middle}}, middle);
  const std::int64_t area = twice_area_of(mesh);
  // The lower edge is the rim of this mesh: its middle becomes a vertex, too.
  EXPECT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{at}).over, 0u);
  EXPECT_EQ(mesh.vertices(), first + 6);
  EXPECT_EQ(twice_area_of(mesh), area);
}

/// A triangle at the rim, with a corner inside the mesh.
TileMesh beside_rim(std::pair<int, int> from, std::pair<int, int> to, std::pair<int, int> inside) {
  return mesh_of({from, to, inside, {0, 100}, {100, kSide}}, {{0, 1, 2}, {0, 2, 3}, {2, 1, 4}, {2, 4, 3}});
}

TEST(refine_stuck, takes_off_a_needle_along_a_rim_where_what_is_wanted_lies_beyond) {
  TileMesh mesh = beside_rim({100, 100}, {101, 115}, {100, 101});
  const Place meter(100.33, 105.3, {{{100, 105, 0}, {101, 105, 0}, {101, 106, 0}}}, std::nullopt);
  ASSERT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 0u);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{2, 4, 3}, {0, 2, 3}, {2, 1, 4}}));
  // Half a cell is ground.
  mesh = beside_rim({100, 100}, {101, 101}, {100, 101});
  const TileMesh before = mesh;
  EXPECT_EQ(refine_stuck(mesh, Place(100.3, 100.7, {{{100, 100, 0}, {101, 100, 0}, {101, 101, 0}}}, std::nullopt), 30,
                         std::vector<std::uint32_t>{0})
                .over,
            1u);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

// It covers samples on a side that the next triangle has, too.
TEST(refine_stuck, takes_off_a_sliver_whose_samples_others_show) {
  const Place meter(100.3, 102.2, {{{100, 102, 0}, {101, 102, proto::kNoHeight}, {101, 103, proto::kNoHeight}}}, std::nullopt);
  TileMesh mesh = beside_rim({100, 100}, {101, 105}, {100, 102});
  const std::int64_t area = twice_area_of(mesh);
  ASSERT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 0u);
  EXPECT_EQ(mesh.triangles.size(), 3u);
  EXPECT_EQ(twice_area_of(mesh), area - 2);
  // One with a sample of its own is cut first, so that the sample stays.
  mesh = beside_rim({100, 100}, {101, 105}, {98, 102});
  const std::int64_t larger = twice_area_of(mesh);
  ASSERT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 0u);
  EXPECT_EQ(twice_area_of(mesh), larger - 2);
  EXPECT_TRUE(std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    return std::ranges::any_of(t, [&](std::uint32_t v) { return mesh.x[v] == 100 && mesh.y[v] == 102; });
  }));
}

// The place is shown by two triangles. To take off the second, the first goes; it waits to be looked at itself.
TEST(refine_stuck, takes_off_what_lies_between_a_triangle_and_the_rim) {
  TileMesh mesh = mesh_of({{100, 100}, {101, 101}, {100, 103}, {101, 100}}, {{0, 1, 2}, {0, 3, 1}});
  const Place meter(100.5, 100.5, {{{100, 100, 0}, {101, 101, 0}, {101, 100, proto::kNoHeight}}}, std::nullopt);
  refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0, 1});
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t v : t) EXPECT_LT(v, mesh.vertices());
  }
  EXPECT_LT(mesh.triangles.size(), 2u);
}

TEST(refine_stuck, leaves_no_corner_with_two_fans) {
  TileMesh mesh = mesh_of({{100, 100}, {101, 101}, {100, 101}, {0, 100}, {100, kSide}}, {{0, 1, 2}, {0, 2, 3}, {2, 1, 4}});
  const TileMesh before = mesh;
  const Place meter(100.3, 100.7, {{{100, 100, 0}, {101, 100, proto::kNoHeight}, {101, 101, 0}}}, std::nullopt);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 1u);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

// A full vertex beside a rim: the rim's edge cannot be turned to it.
TEST(refine_stuck, gives_no_vertex_more_neighbours_than_it_may_have_at_a_rim) {
  TileMesh mesh = fan_above_a_side(kMostValence);
  mesh.y[1] = mesh.y[2] = 63, mesh.x[1] = 127, mesh.x[2] = 128;  // twice the area of their triangle with the fan's middle is 1
  mesh.x.push_back(127), mesh.y.push_back(0), mesh.height.push_back(proto::kNoHeight), mesh.mark.push_back(proto::kVoid);
  const auto beyond = static_cast<std::uint32_t>(mesh.vertices() - 1);
  mesh.triangles.push_back({2, 1, beyond});
  const Place meter(127.7, 63.2, {{{127, 63, 0}, {128, 64, 0}, {127, 64, proto::kNoHeight}}}, std::nullopt);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 1u);
  EXPECT_EQ(neighbours_of(mesh, 0), kMostValence);
}

TEST(refine_stuck, leaves_the_triangle_that_the_lattice_has) {
  TileMesh mesh = mesh_of({{100, 100}, {101, 100}, {101, 101}}, {{0, 1, 2}});
  const TileMesh before = mesh;
  const Place meter(100.7, 100.3, {{{101, 101, 0}, {100, 100, 0}, {101, 100, 0}}}, std::nullopt);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 1u);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

/// The triangle of the lattice at the worst sample, towards the middle of a triangle that is too far off there.
TEST(SampleMeter, wants_the_triangle_of_the_lattice_beside_the_worst_sample) {
  proto::Samples samples = samples_of([](int x, int y) { return x == 100 && y == 100 ? 500.0 : 0.0; });
  const TileMesh flat = mesh_of({{0, 0}, {kSide, 0}, {kSide, kSide}, {0, kSide}}, {{0, 1, 2}, {0, 2, 3}});
  const SampleMeter meter(input_of(flat, samples));
  const auto wanted = [&](std::pair<int, int> a, std::pair<int, int> b, std::pair<int, int> c) {
    std::set<std::pair<int, int>> places;
    const auto triangle = meter.wanted({{{a.first, a.second, 0}, {b.first, b.second, 0}, {c.first, c.second, 0}}}, 10);
    if (triangle) {
      for (const MeshPoint& p : *triangle) {
        places.insert({p.x, p.y});
        EXPECT_EQ(p.height, p.x == 100 && p.y == 100 ? 500 * 1024 : 0);
      }
    }
    return places;
  };
  using Places = std::set<std::pair<int, int>>;
  // The sample is a corner, so the middle's direction is the triangle's.
  EXPECT_EQ(wanted({100, 100}, {140, 101}, {140, 120}), (Places{{100, 100}, {101, 100}, {101, 101}}));
  EXPECT_EQ(wanted({100, 100}, {120, 140}, {101, 140}), (Places{{100, 100}, {101, 101}, {100, 101}}));
  EXPECT_EQ(wanted({100, 100}, {99, 140}, {60, 140}), (Places{{100, 100}, {100, 101}, {99, 100}}));
  EXPECT_EQ(wanted({100, 100}, {60, 99}, {60, 80}), (Places{{100, 100}, {99, 99}, {99, 100}}));
  EXPECT_EQ(wanted({100, 100}, {80, 60}, {99, 60}), (Places{{100, 100}, {99, 99}, {100, 99}}));
  EXPECT_EQ(wanted({100, 100}, {101, 60}, {140, 60}), (Places{{100, 100}, {100, 99}, {101, 100}}));
  EXPECT_TRUE(wanted({10, 10}, {40, 10}, {40, 40}).empty()) << "it is near enough";
  // Beside a corner without data the cell is cut the other way.
  samples.height[101 * (kSide + 1) + 101] = samples.height[99 * (kSide + 1) + 99] = proto::kNoHeight;
  EXPECT_EQ(wanted({100, 100}, {101, 100}, {100, 101}), (Places{{100, 100}, {101, 100}, {100, 101}}));
  EXPECT_EQ(wanted({100, 100}, {99, 100}, {100, 99}), (Places{{100, 100}, {99, 100}, {100, 99}}));
}

TEST(refine_stuck, takes_off_a_triangle_that_no_sample_lies_in_where_the_mesh_ends_at_a_rim) {
  TileMesh mesh = beside_rim({100, 100}, {101, 101}, {100, 101});
  const Place meter(100.3, 100.7, {{{100, 100, 0}, {101, 100, proto::kNoHeight}, {101, 101, 0}}}, std::nullopt);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 0u);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{2, 4, 3}, {0, 2, 3}, {2, 1, 4}}));
}

}  // namespace
}  // namespace cordillera::gpu
