// Refinement keeps promises and the laws of a tile, from a crude mesh.
#include "gpu/refine/refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "gpu/refine/height_step.h"
#include "tests/gpu/measured_tile.h"

namespace cordillera::gpu {
namespace {

TEST(HeightStep, rounds_to_the_nearest_multiple_below_zero_as_above) {
  for (const std::int32_t h : {-1000001, -257, -256, -129, -128, -127, -1, 0, 1, 127, 128, 255, 1000003}) {
    const std::int32_t rounded = rounded_height(h, 256);
    EXPECT_EQ(rounded % 256, 0) << h;
    EXPECT_LE(std::abs(rounded - h), 128) << h;
    EXPECT_EQ(rounded_height(h, 1), h);
  }
  EXPECT_EQ(rounded_height(128, 256), 256);
  EXPECT_EQ(rounded_height(-128, 256), 0);
}

TEST(HeightStep, what_refinement_puts_in_is_a_multiple) {
  const proto::Samples samples = samples_of(kHills);
  TileMesh mesh = coarse(samples, 16);
  for (std::int32_t& h : mesh.height) h = rounded_height(h, 512);
  const std::vector<std::uint32_t> too_far = over(mesh, samples, 4);
  const TileMesh crude = mesh;
  const SampleMeter meter(input_of(crude, samples), 512);
  EXPECT_GT(refine(mesh, SteppedMeter(meter, 512), 4, too_far, SIZE_MAX).inserted, 0u);
  for (const std::int32_t h : mesh.height) EXPECT_EQ(h % 512, 0);
  expect_lawful(mesh);
}

class Refine : public testing::TestWithParam<Height> {};
TEST_P(Refine, leaves_nothing_over_the_limit) {
  const proto::Samples samples = samples_of(GetParam());
  for (const int cells : {16, 64}) {
    for (const double limit_m : {30.0, 2.0}) {
      TileMesh mesh = coarse(samples, cells);
      const std::size_t before = mesh.vertices();
      const std::vector<std::uint32_t> too_far = over(mesh, samples, limit_m);
      const TileMesh crude = mesh;
      const SampleMeter meter(input_of(crude, samples));
      const Refined refined = refine(mesh, meter, limit_m, too_far, SIZE_MAX);
      expect_lawful(mesh);
      EXPECT_EQ(mesh.vertices(), before + refined.inserted);
      // What is left touches the border, which only its chain may change, but for a needle between walls.
      std::size_t inside = 0;
      const std::vector<std::uint32_t> left = over(mesh, samples, limit_m);
      for (const std::uint32_t k : left) {
        const auto& t = mesh.triangles[k];
        inside += std::none_of(t.begin(), t.end(), [&](std::uint32_t v) {
          return mesh.x[v] == 0 || mesh.y[v] == 0 || mesh.x[v] == kSide || mesh.y[v] == kSide;
        });
      }
      EXPECT_EQ(left.size(), refined.over);
      EXPECT_LE(inside, mesh.triangles.size() / 200) << cells << " cells, limit " << limit_m;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Terrains, Refine, testing::Values(kHills, kWalls, kSpike));

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

TEST(refine, makes_the_triangle_that_the_lattice_has_where_insertions_do_not_help) {
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
TEST(refine, makes_a_triangle_on_a_side_with_the_vertices_that_the_side_has) {
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

TEST(refine, says_which_points_of_a_side_it_would_need_and_uses_them_once_they_are_vertices) {
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

TEST(refine, cuts_no_side_without_data_or_room) {
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
  EXPECT_EQ(cuts, kMendedCorner - 3) << "the corner opposite has three neighbours already";
  EXPECT_EQ(mesh.vertices(), 4 + cuts);
  expect_lawful(mesh);
}

TEST(refine, takes_off_a_triangle_that_no_sample_lies_in_where_the_mesh_ends_at_a_rim) {
  TileMesh mesh;
  mesh.side = kSide;
  for (const auto& [x, y] : {std::pair{100, 100}, {101, 101}, {100, 101}, {0, 100}, {100, kSide}})
    mesh.x.push_back(x), mesh.y.push_back(y), mesh.height.push_back(0), mesh.mark.push_back(0);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {2, 1, 4}};
  const Place meter(100.3, 100.7, {{{100, 100, 0}, {101, 100, proto::kNoHeight}, {101, 101, 0}}}, std::nullopt);
  EXPECT_EQ(refine_stuck(mesh, meter, 30, std::vector<std::uint32_t>{0}).over, 0u);
  EXPECT_EQ(mesh.triangles, (std::vector<std::array<std::uint32_t, 3>>{{2, 1, 4}, {0, 2, 3}}));
}

TEST(refine, puts_in_no_more_than_it_may) {
  const proto::Samples samples = samples_of(kHills);
  TileMesh mesh = coarse(samples, 4);
  const TileMesh crude = mesh;
  const Refined refined = refine(mesh, SampleMeter(input_of(crude, samples)), 0.5, over(mesh, samples, 0.5), 7);
  EXPECT_EQ(refined.inserted, 7u);
  EXPECT_GT(refined.over, 0u);
  expect_lawful(mesh);
}

TEST(refine, leaves_voids_void) {
  proto::Samples samples = samples_of(kHills);
  for (int y = 64; y < 192; ++y)
    for (int x = 64; x < 192; ++x) samples.height[static_cast<std::size_t>(y * (kSide + 1) + x)] = proto::kNoHeight;
  TileMesh mesh = coarse(samples, 8);
  const auto published = [](const TileMesh& m) {
    std::int64_t area = 0;
    for (const auto& t : m.triangles) {
      if (!is_published(m, t)) continue;
      area += std::int64_t{m.x[t[1]] - m.x[t[0]]} * (m.y[t[2]] - m.y[t[0]]) -
              std::int64_t{m.y[t[1]] - m.y[t[0]]} * (m.x[t[2]] - m.x[t[0]]);
    }
    return area;
  };
  const std::int64_t before = published(mesh);
  const TileMesh crude = mesh;
  const Refined refined = refine(mesh, SampleMeter(input_of(crude, samples)), 1, over(mesh, samples, 1), SIZE_MAX);
  EXPECT_GT(refined.inserted, 100u);
  EXPECT_EQ(published(mesh), before);
  expect_lawful(mesh);
}

/// Two samples on a rim and a third beside the line between them, by a small part of a unit; all else is level. West of the rim
/// there is no data.
TEST(refine, sheds_a_needle_along_a_rim) {
  constexpr std::int32_t kHigh = 900 * 1024;
  TileMesh mesh;
  mesh.side = kSide;
  const auto add = [&](std::int32_t x, std::int32_t y, std::int32_t height, std::uint8_t mark) {
    mesh.x.push_back(x), mesh.y.push_back(y), mesh.height.push_back(height), mesh.mark.push_back(mark);
  };
  add(0, 0, proto::kNoHeight, proto::kVoid | proto::kKeep);      // 0
  add(kSide, 0, 0, proto::kKeep);                                // 1
  add(kSide, kSide, 0, proto::kKeep);                            // 2
  add(0, kSide, proto::kNoHeight, proto::kVoid | proto::kKeep);  // 3
  add(100, 100, 0, 0);                                           // 4, on the rim
  add(105, 127, kHigh, 0);                                       // 5, on the rim
  add(103, 116, 0, 0);                                           // 6, the needle's corner: twice its area is 1
  mesh.triangles = {{0, 1, 4}, {4, 1, 6}, {6, 1, 5}, {5, 1, 2}, {5, 2, 3}, {0, 4, 3}, {3, 4, 5}, {4, 6, 5}};
  expect_lawful(mesh);
  proto::Samples samples = samples_of([](int, int) { return 0.0; });
  for (int y = 0; y <= kSide; ++y)
    for (int x = 0; x < 100; ++x) samples.height[static_cast<std::size_t>(y * (kSide + 1) + x)] = proto::kNoHeight;
  samples.height[127 * (kSide + 1) + 105] = kHigh;
  const std::uint32_t needle = 7;
  const TileMesh crude = mesh;
  SurfaceErrorInput in = input_of(crude, samples);
  in.ecef_steps = 1;
  refine(mesh, SampleMeter(in), 50, std::vector<std::uint32_t>{needle}, SIZE_MAX);
  expect_lawful(mesh);
  for (const auto& t : mesh.triangles) {
    const bool is_needle =
        std::count(t.begin(), t.end(), 4u) + std::count(t.begin(), t.end(), 5u) + std::count(t.begin(), t.end(), 6u) == 3;
    EXPECT_FALSE(is_published(mesh, t) && is_needle);
  }
}

/// Walls that no vertex helps: every triangle is too far off, whatever is done.
class Hopeless final : public ErrorMeter {
 public:
  TriangleError measure(const std::array<MeshPoint, 3>&, double) const override { return {.error_m = 10}; }
  double error_m(const std::array<MeshPoint, 3>&, const Glance&) const override { return 10; }
};

TEST(refine, gives_up_where_nothing_helps) {
  const proto::Samples samples = samples_of(kHills);
  TileMesh mesh = coarse(samples, 16);
  std::vector<std::uint32_t> all(mesh.triangles.size());
  std::iota(all.begin(), all.end(), 0u);
  const Refined refined = refine(mesh, Hopeless(), 1, all, SIZE_MAX);
  EXPECT_EQ(refined.inserted, 0u);
  EXPECT_GT(refined.flipped, 0u);
  EXPECT_LE(refined.flipped, 8 * mesh.vertices()) << "turns that help nobody";
  EXPECT_GT(refined.over, 0u);
  expect_lawful(mesh);
}

TEST(refine, nothing_over_nothing_done) {
  const proto::Samples samples = samples_of(kHills);
  TileMesh mesh = coarse(samples, 64);
  const TileMesh crude = mesh;
  const Refined refined = refine(mesh, SampleMeter(input_of(crude, samples)), 1e6, {}, SIZE_MAX);
  EXPECT_EQ(refined.inserted + refined.flipped, 0u);
  EXPECT_EQ(mesh.triangles, crude.triangles);
}

}  // namespace
}  // namespace cordillera::gpu
