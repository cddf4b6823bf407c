// Refinement keeps promises and the laws of a tile, from a crude mesh.
#include "gpu/refine/refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

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
