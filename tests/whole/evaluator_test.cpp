// The judge judged: by hand-made surfaces whose error is known, and against what gpu states.
#include "tests/whole/evaluator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "gpu/measure/surface_error.h"

namespace cordillera::whole {
namespace {

/// cells x cells grid of a tile of finest level z (256 units a side), heights from steps(column, row).
template <class Steps>
DecodedTile grid(proto::TileAddress address, std::int32_t cells, const Steps& steps) {
  DecodedTile t{address, 256, {}, {}, {}, {}};
  const std::int32_t step = 256 / cells;
  for (std::int32_t v = 0; v <= cells; ++v)
    for (std::int32_t u = 0; u <= cells; ++u) {
      t.u.push_back(u * step);
      t.v.push_back(v * step);
      t.h.push_back(steps(address.x * 256 + u * step, address.y * 256 + v * step));
    }
  for (std::int32_t v = 0; v < cells; ++v)
    for (std::int32_t u = 0; u < cells; ++u) {
      const auto sw = static_cast<std::uint32_t>(v * (cells + 1) + u), nw = sw + static_cast<std::uint32_t>(cells + 1);
      t.triangles.push_back({sw, sw + 1, nw + 1});
      t.triangles.push_back({sw, nw + 1, nw});
    }
  return t;
}
std::int32_t sea(std::int64_t, std::int64_t) { return 0; }

TEST(evaluator, full_grid_has_no_error) {
  const proto::TileAddress tile{12, 3000, 3000};
  const auto hills = [](std::int64_t i, std::int64_t j) {
    return static_cast<std::int32_t>(1024 * 50 * std::sin(0.3 * static_cast<double>(i) + 0.2 * static_cast<double>(j)));
  };
  const Measured m =
      measure(surface_of(grid(tile, 256, hills)), proto::Lattice{12}, tile, [&](auto i, auto j) { return hills(i, j) / 1024.0; });
  EXPECT_LT(m.max_m, 1e-4);
  EXPECT_EQ(m.samples, 257u * 257u);
  EXPECT_EQ(m.uncovered, 0u);
}

TEST(evaluator, sea_sags) {
  const proto::TileAddress tile{6, 64, 31};
  const Measured m = measure(surface_of(grid(tile, 4, sea)), proto::Lattice{6}, tile, [](auto, auto) { return 0.0; });
  const double half = 0.5 * std::sqrt(2.0) * 64 * 180.0 / (256 * 64) * std::numbers::pi / 180 * 6371000;
  EXPECT_NEAR(m.max_m, half * half / (2 * 6371000), 0.02 * m.max_m);
  EXPECT_GT(m.rmse_m, 0.4 * m.max_m);
  EXPECT_LT(m.rmse_m, 0.8 * m.max_m);
}

TEST(evaluator, finds_one_wrong_sample_and_one_missing_triangle) {
  const proto::TileAddress tile{12, 3000, 3000};
  DecodedTile t = grid(tile, 16, sea);
  const std::int64_t i = 3000 * 256 + 77, j = 3000 * 256 + 130;
  const auto spike = [&](std::int64_t a, std::int64_t b) { return std::optional<double>(a == i && b == j ? 12.5 : 0.0); };
  const Measured m = measure(surface_of(t), proto::Lattice{12}, tile, spike);
  EXPECT_NEAR(m.max_m, 12.5, 0.05);
  EXPECT_EQ(m.worst_i, i);
  EXPECT_EQ(m.worst_j, j);
  t.triangles.erase(t.triangles.begin() + 100);
  // The inner samples of a triangle of 16 by 16, and those of the edges whose chords bend out of it.
  const auto uncovered = measure(surface_of(t), proto::Lattice{12}, tile, spike).uncovered;
  EXPECT_GE(uncovered, 15u * 14u / 2);
  EXPECT_LE(uncovered, 15u * 14u / 2 + 2 * 15u);
  const auto none = [&](std::int64_t a, std::int64_t) { return a < i ? std::nullopt : std::optional<double>(0.0); };
  EXPECT_EQ(measure(surface_of(grid(tile, 16, sea)), proto::Lattice{12}, tile, none).samples, (257u - 77u) * 257u);
}

/// Law 3 in small: what gpu states is no less than what a ray caster finds, and not much more.
void expect_stated(int z, proto::TileAddress tile, std::int32_t cells, double rough_m) {
  SCOPED_TRACE(testing::Message() << "z " << z << " x " << tile.x << " y " << tile.y << " cells " << cells);
  const proto::Lattice lattice{z};
  const auto rough = [&](std::int64_t i, std::int64_t j) {
    if (j == 0 || j == lattice.rows()) i = 0;
    std::minstd_rand random(static_cast<unsigned>(((i % lattice.columns()) * 7919 + j * 104729) % 2000000000 + 1));
    random.discard(3);
    return static_cast<std::int32_t>(1024 * rough_m * static_cast<double>(random() % 1000) / 1000);
  };
  const DecodedTile decoded = grid(tile, cells, rough);
  proto::Samples samples{lattice.west(tile), lattice.south(tile), 257, 257, {}, {}};
  for (std::int64_t j = 0; j <= 256; ++j)
    for (std::int64_t i = 0; i <= 256; ++i) samples.height.push_back(rough(samples.west + i, samples.south + j));
  proto::TileMesh mesh{256, decoded.u, decoded.v, decoded.h, std::vector<std::uint8_t>(decoded.u.size(), 0), decoded.triangles};
  const double step_m = std::ldexp(1.0, 4 - z);
  gpu::SurfaceErrorInput in;
  in.lattice = &lattice;
  in.tile = tile;
  in.mesh = &mesh;
  in.samples = &samples;
  in.ecef_steps = step_m;
  const gpu::SurfaceError stated = gpu::surface_error(in, 1e9);
  const auto truth = [&](std::int64_t i, std::int64_t j) { return std::optional<double>(samples.at(i, j) / 1024.0); };
  const DecodedSurface drc = surface_of(decoded);
  DecodedSurface glb = drc;
  for (Point& p : glb.points)
    for (double& c : p) c = std::nearbyint(c / step_m) * step_m;
  const Measured one = measure(drc, lattice, tile, truth), other = measure(glb, lattice, tile, truth);
  EXPECT_GE(stated.max_m, std::max(one.max_m, other.max_m) - 1e-3);
  EXPECT_LE(stated.max_m, std::max(one.max_m, other.max_m) * 1.2 + 1e-3);
  EXPECT_NEAR(std::sqrt(stated.sum_squared_m2 / stated.samples), one.rmse_m, 0.03 * one.rmse_m + 1e-3);
}

TEST(evaluator, agrees_with_what_is_stated) {
  for (const double rough_m : {0.0, 6000.0})
    for (const std::int32_t cells : {64, 8}) {
      expect_stated(14, {14, 20000, 13653}, cells, rough_m);
      expect_stated(8, {8, 511, 100}, cells, rough_m);
      expect_stated(5, {5, 0, 26}, cells, rough_m);
      expect_stated(3, {3, 9, 6}, cells, rough_m);
      expect_stated(2, {2, 3, 1}, cells, rough_m);
    }
}

/// Steep triangles whose chords leave the straight lattice lines by more than a sample, over a terrain that follows those lines:
/// near the edges a sample is shown by another triangle than the one that holds it in plan.
TEST(evaluator, chords_show_samples_beyond_the_edge) {
  const proto::Lattice lattice{10};
  const proto::TileAddress tile{8, 300, 213};
  const std::int32_t cell = 512, side = 2 * cell;
  const std::int32_t metres[9] = {0, 15000, 0, 15000, 0, 15000, 0, 15000, 15000};
  DecodedTile decoded = grid(tile, 2, sea);
  decoded.side = side;
  for (std::size_t k = 0; k < 9; ++k) decoded.u[k] *= 4, decoded.v[k] *= 4, decoded.h[k] = 1024 * metres[k];
  proto::Samples samples{lattice.west(tile), lattice.south(tile), side + 1, side + 1, {}, {}};
  for (std::int32_t y = 0; y <= side; ++y)
    for (std::int32_t x = 0; x <= side; ++x) {
      const std::int32_t i = std::min(x / cell, 1), j = std::min(y / cell, 1), u = x - i * cell, v = y - j * cell;
      const std::int32_t *sw = metres + 3 * j + i, *nw = sw + 3;
      const std::int64_t rise = u >= v ? u * std::int64_t{sw[1] - sw[0]} + v * std::int64_t{nw[1] - sw[1]}
                                       : v * std::int64_t{nw[0] - sw[0]} + u * std::int64_t{nw[1] - nw[0]};
      samples.height.push_back(static_cast<std::int32_t>(1024 * (sw[0] * std::int64_t{cell} + rise) / cell));
    }
  const proto::TileMesh mesh{side, decoded.u, decoded.v, decoded.h, std::vector<std::uint8_t>(9, 0), decoded.triangles};
  gpu::SurfaceErrorInput in;
  in.lattice = &lattice;
  in.tile = tile;
  in.mesh = &mesh;
  in.samples = &samples;
  in.ecef_steps = 0.25;
  const gpu::SurfaceError stated = gpu::surface_error(in, 1e9);
  const Measured m = measure(surface_of(decoded), lattice, tile, [&](auto i, auto j) { return samples.at(i, j) / 1024.0; });
  EXPECT_GE(stated.max_m, m.max_m - 1e-3);
  EXPECT_LE(stated.max_m, m.max_m * 1.01);
}

}  // namespace
}  // namespace cordillera::whole
