// The fit of height meshes: laws, counts, bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "gpu/fit/simplify_height_grid.h"
#include "tests/gpu/fit_judge.h"

namespace cordillera::gpu::fit {
namespace {

TEST(Fit, CountsAreExact) {
  const HeightMesh in = terrain(bench::Terrain::alpine, 65);
  for (const Quality quality : kQualities) {
    for (const std::uint64_t count : {4000u, 1001u, 820u, 99u})
      EXPECT_EQ(simplified(in, MeshTarget::triangles(count), quality).report.triangles, count);
  }
  EXPECT_EQ(simplified(in, MeshTarget::keep(0.1)).report.triangles, 819u);
}

TEST(Fit, EveryTerrainKeepsTheLaws) {
  for (int kind = 0; kind < 6; ++kind) {
    const HeightMesh in = terrain(static_cast<bench::Terrain>(kind), 50);
    HeightMesh whole = in;
    for (double& z : whole.z) z = std::max(z, -1000.0);  // one kind has holes in it
    simplified(whole, MeshTarget::keep(0.1));
  }
}

TEST(Fit, EachStepOfQualityLessensTheError) {
  const HeightMesh in = terrain(bench::Terrain::alpine, 129);
  const MeshTarget target = MeshTarget::keep(0.1);
  const auto fast = simplified(in, target, Quality::fast).report, normal = simplified(in, target).report;
  const auto best = simplified(in, target, Quality::best).report, minimax = simplified(in, target, Quality::minimax).report;
  EXPECT_LT(normal.rmse_m, 0.8 * fast.rmse_m);
  EXPECT_LT(best.rmse_m, normal.rmse_m);
  EXPECT_LT(minimax.max_error_m, best.max_error_m);
}

double steepest_edge(const HeightMesh& mesh) {
  double steepest = 0;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      steepest = std::max(steepest, std::abs(mesh.z[b] - mesh.z[a]) / std::hypot(mesh.x[b] - mesh.x[a], mesh.y[b] - mesh.y[a]));
    }
  }
  return steepest;
}

TEST(Fit, EveryQualityStaysWithinTheLimit) {
  const HeightMesh in = terrain(bench::Terrain::noise, 49);
  for (const Quality quality : kQualities) {
    for (const double error : {1.0, 20.0})
      EXPECT_LE(simplified(in, MeshTarget::error_m(error), quality).report.max_error_m, error) << static_cast<int>(quality);
  }
}

/// A mesh of needles: where no vertex of the input is, nothing but the edges says how steep the ground may be.
TEST(Fit, ScatteredVerticesMakeNoSpikes) {
  HeightMesh in;
  constexpr std::uint32_t kRows = 40, kColumns = 40;
  for (std::uint32_t r = 0; r < kRows; ++r) {
    for (std::uint32_t c = 0; c < kColumns; ++c) {
      const double hash = std::fmod(std::abs(std::sin(12.9898 * c + 78.233 * r)) * 43758.5453, 1.0);
      const bool inside = c > 0 && r > 0 && c + 1 < kColumns && r + 1 < kRows;
      in.x.push_back(1000.0 * c + (inside ? 700 * (hash - 0.5) : 0));
      in.y.push_back(2.0 * r + (inside ? 1.2 * (std::fmod(7 * hash, 1.0) - 0.5) : 0));  // 500 times as long as they are wide
      in.z.push_back(300 * std::sin(c / 4.0) + 2 * std::sin(r / 2.0) + hash);
    }
  }
  in.triangles = bench::grid_triangles(kColumns, kRows);
  const double steep = steepest_edge(in), relief = std::ranges::max(in.z) - std::ranges::min(in.z);
  for (const Quality quality : kQualities) {
    for (const MeshTarget& target :
         {MeshTarget::error_m(0.5), MeshTarget::error_m(3), MeshTarget::keep(0.8), MeshTarget::keep(0.3)}) {
      const auto out = simplify(in, target, {quality, "cpu"});  // whose plan is rounded too much for the other laws
      ASSERT_TRUE(out.ok());
      const auto [low, high] = std::ranges::minmax(out->mesh.z);
      EXPECT_LT(high - low, 1.2 * relief) << static_cast<int>(quality);
      if (target.kind == MeshTarget::Kind::error_m) {
        EXPECT_LE(steepest_edge(out->mesh), 4.1 * steep) << static_cast<int>(quality);
        EXPECT_LE(judged(in, out->mesh).max, target.value) << static_cast<int>(quality);
      }
    }
  }
}

TEST(Fit, SameInputSameResult) {
  const HeightMesh in = terrain(bench::Terrain::rolling, 80);
  const auto first = simplified(in, MeshTarget::keep(0.2)), second = simplified(in, MeshTarget::keep(0.2));
  EXPECT_EQ(first.mesh.triangles, second.mesh.triangles);
  EXPECT_EQ(first.mesh.x, second.mesh.x);
  EXPECT_EQ(first.mesh.z, second.mesh.z);
}

TEST(Fit, OrderOfTrianglesAndTheirTurnDoNotMatter) {
  const HeightMesh in = terrain(bench::Terrain::rolling, 40);
  HeightMesh turned = in;
  std::reverse(turned.triangles.begin(), turned.triangles.end());
  for (auto& t : turned.triangles) t = {t[2], t[1], t[0]};
  EXPECT_EQ(simplified(in, MeshTarget::keep(0.2)).mesh.z, simplified(turned, MeshTarget::keep(0.2)).mesh.z);
}

TEST(Fit, PlaneBecomesTwoTriangles) {
  const auto flat = simplified(grid(33, 65, 10, [](double, double) { return 7.0; }), MeshTarget::triangles(2));
  EXPECT_EQ(flat.report.triangles, 2u);
  EXPECT_EQ(flat.report.max_error_m, 0);
  const auto tilted = simplified(grid(64, 64, 10, [](double c, double r) { return 3 * c - 2 * r; }), MeshTarget::error_m(0.01));
  EXPECT_LE(tilted.report.triangles, 8u);
  EXPECT_LE(tilted.report.max_error_m, 0.01);
}

TEST(Fit, ErrorsInMetresAreHonoured) {
  for (const bench::Terrain kind : {bench::Terrain::alpine, bench::Terrain::rolling, bench::Terrain::city}) {
    const HeightMesh in = terrain(kind, 60);
    std::uint64_t before = in.triangles.size() + 1;
    for (const double error : {0.05, 1.0, 20.0}) {
      const auto out = simplified(in, MeshTarget::error_m(error));
      EXPECT_LE(judged(in, out.mesh).max, error);
      EXPECT_LT(out.report.triangles, before);
      before = out.report.triangles;
    }
  }
}

TEST(Fit, SpikeStaysWhereItIs) {
  const HeightMesh in = grid(41, 41, 30, [](double c, double r) { return c == 20 && r == 20 ? 500.0 : 0.0; });
  const auto out = simplified(in, MeshTarget::error_m(1));
  EXPECT_LE(out.report.triangles, 60u);
  EXPECT_LE(judged(in, out.mesh).max, 1);
}

TEST(Fit, InputsThatHurt) {
  const auto noise = [](std::uint32_t c, std::uint32_t r) { return static_cast<double>(bench::mixed(c, r, 9) % 100000) / 100; };
  const auto ridge = [](std::uint32_t c, std::uint32_t) { return c == 25 ? 80.0 : 0.0; };
  const auto cliff = [](std::uint32_t c, std::uint32_t r) { return c + r / 3 < 30 ? 0.0 : 10000.0; };
  const auto faint = [](std::uint32_t c, std::uint32_t r) { return 4000 + 1e-3 * bench::smooth_noise(c, r, 4, 3); };
  const auto vast = [](std::uint32_t c, std::uint32_t r) { return 3e38 * bench::smooth_noise(c, r, 4, 3); };
  for (const Quality quality : kQualities) {
    simplified(grid(50, 50, 30, noise), MeshTarget::keep(0.3), quality);
    simplified(grid(50, 50, 30, ridge), MeshTarget::keep(0.1), quality);
    simplified(grid(50, 50, 30, cliff), MeshTarget::keep(0.1), quality);
    const auto shallow = simplify(grid(50, 50, 30, faint), MeshTarget::keep(0.1), {quality, "cpu"});
    ASSERT_TRUE(shallow.ok());
    EXPECT_LT(shallow->report.max_error_m, 1e-3);
    const auto deep = simplify(grid(50, 50, 30, vast), MeshTarget::keep(0.1), {quality, "cpu"});
    ASSERT_TRUE(deep.ok());
    EXPECT_LT(deep->report.rmse_m, 1e37);
  }
}

/// Scattered vertices, a border that is not straight, a hole: rings of a disc.
HeightMesh disc(std::uint32_t rings, std::uint32_t spokes) {
  HeightMesh mesh;
  for (std::uint32_t r = 0; r <= rings; ++r) {
    for (std::uint32_t s = 0; s < spokes; ++s) {
      const double angle = 6.283185307179586 * s / spokes, radius = 100 + 20.0 * r;
      mesh.x.push_back(radius * std::cos(angle));
      mesh.y.push_back(radius * std::sin(angle));
      mesh.z.push_back(30 * std::sin(angle * 3) + 0.1 * radius * std::cos(angle * 5));
    }
  }
  for (std::uint32_t r = 0; r < rings; ++r) {
    for (std::uint32_t s = 0; s < spokes; ++s) {
      const std::uint32_t a = r * spokes + s, b = r * spokes + (s + 1) % spokes, c = a + spokes, d = b + spokes;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  }
  return mesh;
}

TEST(Fit, CurvedBordersStayAndInsidesGo) {
  const HeightMesh in = disc(30, 64);
  for (const Quality quality : kQualities) {
    const auto out = simplified(in, MeshTarget::keep(0.25), quality);
    EXPECT_EQ(out.report.triangles, in.triangles.size() / 4);
    EXPECT_LT(out.report.rmse_m, 2);
  }
  const auto bounded = simplified(in, MeshTarget::error_m(2));
  EXPECT_LE(judged(in, bounded.mesh).max, 2);
  EXPECT_LT(bounded.report.triangles, in.triangles.size() / 4);
}

TEST(Fit, LatticeWithAHoleKeepsIt) {
  HeightMesh in = terrain(bench::Terrain::rolling, 40);
  std::erase_if(in.triangles, [&](const auto& t) {
    return std::all_of(t.begin(), t.end(),
                       [&](std::uint32_t v) { return std::abs(in.x[v] - 1600) < 200 && std::abs(in.y[v] - 100) < 150; });
  });
  HeightMesh used = in;
  std::vector<std::uint32_t> number(in.vertices(), ~0u);
  used.x.clear(), used.y.clear(), used.z.clear();
  for (auto& t : used.triangles) {
    for (std::uint32_t& v : t) {
      if (number[v] == ~0u) {
        number[v] = static_cast<std::uint32_t>(used.x.size());
        used.x.push_back(in.x[v]), used.y.push_back(in.y[v]), used.z.push_back(in.z[v]);
      }
      v = number[v];
    }
  }
  EXPECT_EQ(simplified(used, MeshTarget::triangles(300)).report.triangles, 300u);
}

/// Shifts inner vertices, so that they are no lattice any more.
HeightMesh shaken(HeightMesh mesh) {
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const auto off = [&](std::uint32_t k) { return bench::mixed(static_cast<std::uint32_t>(v), k, 5) % 1000 / 250.0 - 2; };
    const bool inner_x = mesh.x[v] > mesh.x.front() && mesh.x[v] < mesh.x.back();
    const bool inner_y = mesh.y[v] > mesh.y.front() && mesh.y[v] < mesh.y.back();
    if (inner_x && inner_y) mesh.x[v] += off(1), mesh.y[v] += off(2);
  }
  return mesh;
}

TEST(Fit, FastDropsInBlocksAndOutsideThem) {
  using enum bench::Terrain;
  for (const bench::Terrain kind : {rolling, city, noise, plane}) {
    const HeightMesh in = terrain(kind, 101);  // blocks of 32 by 32, cut ones, and seams
    for (const std::uint64_t count : {9000u, 2001u, 700u}) {
      EXPECT_EQ(simplified(in, MeshTarget::triangles(count), Quality::fast).report.triangles, count);
      EXPECT_EQ(simplified(shaken(in), MeshTarget::triangles(count), Quality::fast).report.triangles, count);
    }
  }
}

/// Drops hand on the planes of what goes; without that the error is three times as much.
TEST(Fit, FastRemembersWhatItDropped) {
  const HeightMesh in = terrain(bench::Terrain::rolling, 200);
  const MeshTarget target = MeshTarget::keep(0.1);
  EXPECT_LT(simplified(in, target, Quality::fast).report.rmse_m, 5 * simplified(in, target).report.rmse_m);
}

TEST(Fit, FastKeepsWhatStandsOutOfAPlain) {
  const HeightMesh in = grid(101, 101, 30, [](double c, double r) {
    const bool spike = (c == 16 && r == 16) || (c == 31 && r == 50) || (c == 64 && r == 64);  // in a block, at a seam, a corner
    return spike ? 500.0 : 0.5 * c;
  });
  const auto out = simplified(in, MeshTarget::keep(0.1), Quality::fast);
  EXPECT_EQ(out.report.triangles, 2000u);
  EXPECT_LT(out.report.max_error_m, 1);
}

TEST(Fit, MoreThanThereIsGivesTheInputBack) {
  const HeightMesh in = terrain(bench::Terrain::rolling, 9);
  const auto out = simplified(in, MeshTarget::triangles(1000), Quality::fast);
  EXPECT_EQ(out.report.triangles, in.triangles.size());
  EXPECT_NEAR(out.report.max_error_m, 0, 1e-4);
}

/// Each vertex of such a mesh is one that matters, so that little may go, and none may be drawn to what lies between them.
TEST(Fit, AMeshThatWasSimplifiedKeepsItsHeights) {
  const HeightMesh in = simplified(terrain(bench::Terrain::alpine, 129), MeshTarget::keep(0.15)).mesh;
  const double tenth_m = simplified(in, MeshTarget::keep(0.1)).report.rmse_m;
  for (const Quality quality : {Quality::default_, Quality::best}) {
    const auto most = simplified(in, MeshTarget::keep(0.95), quality).report,
               half = simplified(in, MeshTarget::keep(0.5), quality).report;
    EXPECT_LT(most.rmse_m, 0.01 * tenth_m) << static_cast<int>(quality);
    EXPECT_LT(half.rmse_m, 0.15 * tenth_m) << static_cast<int>(quality);
  }
}

void expect_same(const HeightMesh& one, const HeightMesh& other) {
  EXPECT_EQ(one.triangles, other.triangles);
  EXPECT_EQ(one.x, other.x);
  EXPECT_EQ(one.y, other.y);
  EXPECT_EQ(one.z, other.z);
}

TEST(Fit, WhatAsksForNothingGivesTheInputBack) {
  HeightMesh in = simplified(terrain(bench::Terrain::alpine, 65), MeshTarget::keep(0.3)).mesh;
  for (const bool clockwise : {false, true}) {
    for (const MeshTarget& target : {MeshTarget::keep(1), MeshTarget::error_m(0)}) {
      HeightMesh turned = in;
      if (clockwise) {
        for (auto& t : turned.triangles) std::swap(t[1], t[2]);
      }
      const auto out = simplified(turned, target);
      expect_same(out.mesh, in);
      EXPECT_EQ(out.report.max_error_m, 0);
    }
  }
  // Places are rounded, to more than so small an error allows.
  for (std::size_t v = 0; v < in.vertices(); ++v)
    std::tie(in.x[v], in.y[v]) = std::pair(0.8 * in.x[v] - 0.6 * in.y[v], 0.6 * in.x[v] + 0.8 * in.y[v]);
  EXPECT_LE(simplified(in, MeshTarget::error_m(1e-4)).report.max_error_m, 1e-4);
}

TEST(Fit, ThreadsDoNotShow) {
  const HeightMesh in = terrain(bench::Terrain::alpine, 100), scattered = shaken(in);
  for (const Quality quality : kQualities) {
    for (const HeightMesh* mesh : {&in, &scattered}) {
      const auto alone = simplify(*mesh, MeshTarget::keep(0.1), {quality, "cpu", 1});
      for (const unsigned threads : {2u, 3u}) {
        expect_same(alone->mesh, simplify(*mesh, MeshTarget::keep(0.1), {quality, "cpu", threads})->mesh);
      }
    }
  }
}

/// The mesh that a grid stands for.
HeightMesh mesh_of(const HeightGrid& from) {
  HeightMesh mesh = grid(from.columns, from.rows, from.cell_x,
                         [&](std::uint32_t c, std::uint32_t r) { return static_cast<double>(from.z[r * from.columns + c]); });
  for (double& x : mesh.x) x += from.x0 - 1000;
  for (double& y : mesh.y) y += from.y0 + 500;
  return mesh;
}

TEST(Fit, GridsAreMeshes) {
  auto simplifier = GridSimplifier::make("cpu", 2);
  ASSERT_TRUE(simplifier.ok());
  for (const auto& [columns, rows] : {std::pair{2u, 2u}, {33u, 7u}, {70u, 65u}, {9u, 100u}}) {
    std::vector<float> z(columns * rows);
    for (std::uint32_t i = 0; i < z.size(); ++i) z[i] = static_cast<float>(bench::mixed(i % columns, i / columns, 3) % 1000) / 8;
    const HeightGrid from{z.data(), false, columns, rows, 64, 128, 32, 32};
    for (const Quality quality : {Quality::fast, Quality::default_}) {
      const MeshOptions options{quality, "cpu"};
      const auto result = simplifier->simplify(from, MeshTarget::keep(0.3), options);
      ASSERT_TRUE(result.ok());
      expect_same(result->mesh, simplify(mesh_of(from), MeshTarget::keep(0.3), options)->mesh);
      expect_same(result->mesh, simplifier->simplify(simplifier->keep(from), MeshTarget::keep(0.3), options)->mesh);
    }
    const auto bounded = simplifier->simplify(from, MeshTarget::error_m(20));
    EXPECT_LE(bounded->report.max_error_m, 20);
    expect_same(bounded->mesh, simplify(mesh_of(from), MeshTarget::error_m(20), {Quality::default_, "cpu"})->mesh);
  }
}

TEST(Fit, CudaGivesTheBitsOfTheCpu) {
  const HeightMesh lattice = terrain(bench::Terrain::alpine, 200), scattered = simplified(lattice, MeshTarget::keep(0.3)).mesh;
  for (const Quality quality : kQualities) {
    for (const auto& [in, target] : {std::pair{&lattice, MeshTarget::keep(0.1)},
                                     {&scattered, MeshTarget::keep(0.9)},
                                     {&scattered, MeshTarget::keep(0.1)},
                                     {&scattered, MeshTarget::error_m(2)}}) {
      const auto cuda = simplify(*in, target, {quality, "cuda"});
      if (!cuda.ok()) GTEST_SKIP() << "no CUDA device: " << cuda.problem().detail;
      const auto cpu = simplify(*in, target, {quality, "cpu"});
      expect_same(cpu->mesh, cuda->mesh);
    }
  }
}

}  // namespace
}  // namespace cordillera::gpu::fit
