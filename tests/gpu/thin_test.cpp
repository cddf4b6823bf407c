// Thinning takes out what the promise does not need, and nothing else.
#include "gpu/waves/thin.h"

#include <gtest/gtest.h>

#include "tests/gpu/measured_tile.h"
#include "tests/gpu/meter_glance.h"

namespace cordillera::gpu {
namespace {

struct Thinned {
  TileMesh mesh;
  std::uint32_t gone = 0;
};
Thinned thinned(const proto::Samples& samples, const TileMesh& from, const Thinning& how) {
  Thinned result{from, 0};
  result.gone = thin(result.mesh, SampleMeter(input_of(from, samples)), how);
  return result;
}

class Thin : public testing::TestWithParam<Height> {};
TEST_P(Thin, keeps_the_promise_and_the_laws) {
  const proto::Samples samples = samples_of(GetParam());
  const TileMesh grid = coarse(samples, kSide);
  constexpr double kLimit_m = 5;
  const auto [mesh, gone] = thinned(samples, grid, {kLimit_m, 0});
  expect_lawful(mesh);
  EXPECT_EQ(mesh.vertices() + gone, grid.vertices());
  EXPECT_GT(gone, grid.vertices() / 2);
  EXPECT_TRUE(over(mesh, samples, kLimit_m + 1e-9).empty());
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v)
    EXPECT_EQ(mesh.height[v], samples.height[static_cast<std::size_t>(mesh.y[v] * (kSide + 1) + mesh.x[v])])
        << "heights are those of samples";
  // What is thin already, thinned again with a greater limit and with heights that move.
  const Thinned more = thinned(samples, mesh, {2 * kLimit_m, 0}), moved = thinned(samples, mesh, {2 * kLimit_m, 2});
  expect_lawful(moved.mesh);
  EXPECT_LE(more.mesh.vertices(), mesh.vertices());
  EXPECT_LE(moved.mesh.vertices(), more.mesh.vertices());
  EXPECT_TRUE(over(moved.mesh, samples, 2 * kLimit_m + 1e-9).empty());
}
TEST_P(Thin, a_glance_agrees_with_the_whole) {
  const proto::Samples samples = samples_of(GetParam());
  const TileMesh grid = coarse(samples, kSide);
  const auto [low, high] = std::minmax_element(grid.height.begin(), grid.height.end());
  expect_glance_agrees(SampleMeter(input_of(grid, samples)), kSide, *low, *high);
}
INSTANTIATE_TEST_SUITE_P(Terrains, Thin, testing::Values(kHills, kWalls, kSpike));

TEST(thin, leaves_what_is_marked_and_the_border) {
  const proto::Samples samples = samples_of([](int, int) { return 7.0; });
  TileMesh grid = coarse(samples, 16);
  const auto marked = static_cast<std::uint32_t>(5 * 17 + 9);
  grid.mark[marked] = proto::kKeep;
  const auto [mesh, gone] = thinned(samples, grid, {100.0, 0});
  expect_lawful(mesh);
  std::size_t border = 0, inside = 0;
  bool found = false;
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    (sides_of(mesh, v) > 0 ? border : inside) += 1;
    found = found || (mesh.x[v] == grid.x[marked] && mesh.y[v] == grid.y[marked]);
  }
  EXPECT_EQ(border, 64u);
  EXPECT_TRUE(found);
  EXPECT_LT(inside, 225u / 4);  // valences on the border stop it, not the error
}

TEST(thin, leaves_rims_alone) {
  const proto::Samples samples = samples_of([](int, int) { return 7.0; });
  TileMesh grid = coarse(samples, 16);
  grid.mark[8 * 17 + 8] = proto::kVoid;
  const auto [mesh, gone] = thinned(samples, grid, {100.0, 0});
  expect_lawful(mesh);
  EXPECT_GT(gone, 0u);
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {1, 1}, {-1, -1}}) {
    const std::int32_t x = (8 + dx) * 16, y = (8 + dy) * 16;
    bool found = false;
    for (std::uint32_t v = 0; v < mesh.vertices(); ++v) found = found || (mesh.x[v] == x && mesh.y[v] == y);
    EXPECT_TRUE(found) << x << ", " << y;
  }
}

}  // namespace
}  // namespace cordillera::gpu
