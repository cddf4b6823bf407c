// Places without data that triangles show, because rims have moved over them: what is known of them where samples are out of
// reach, and how near rims come to the sides of tiles.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "gpu/simplify.h"
#include "pipeline/bound/composed_error.h"
#include "pipeline/bound/cover.h"
#include "pipeline/bound/loose.h"
#include "pipeline/bound/overlay.h"
#include "pipeline/tile/to_void.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

constexpr proto::TileAddress kPlace{12, 2000, 1500};
const proto::Lattice kGround{12};

/// A grid whose vertices are void with one in `often`.
TileMesh holed(std::int32_t cells, std::int32_t side, unsigned seed, unsigned often) {
  const auto across = static_cast<std::size_t>(cells) + 1;
  TileMesh mesh = gpu::grid_mesh(cells, side / cells, std::vector<std::int32_t>(across * across, 100 * 1024));
  std::mt19937 random(seed);
  for (auto& mark : mesh.mark)
    if (random() % often == 0) mark |= proto::kVoid;
  return mesh;
}

/// A window over the tile with single samples without data.
proto::Samples specked(unsigned often) {
  proto::Samples samples{kGround.west(kPlace), kGround.south(kPlace), 257, 257, {}, {}};
  std::mt19937 random(3);
  for (std::int32_t k = 0; k < 257 * 257; ++k) samples.height.push_back(random() % often == 0 ? proto::kNoHeight : 100 * 1024);
  return samples;
}

bool lies_in(const TileMesh& mesh, const std::array<std::uint32_t, 3>& t, const gpu::MeshPoint& p) {
  const auto at = [&](int k) { return gpu::MeshPoint{mesh.x[t[k]], mesh.y[t[k]], 0}; };
  return gpu::twice_area(at(0), at(1), p) >= 0 && gpu::twice_area(at(1), at(2), p) >= 0 && gpu::twice_area(at(2), at(0), p) >= 0;
}
bool is_marked(const TileMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return (mesh.mark[v] & kOverVoid) != 0; });
}
/// Does a triangle that is published, and not marked, hold the place?
bool shown_unmarked(const TileMesh& mesh, const gpu::MeshPoint& p) {
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(),
                     [&](const auto& t) { return is_published(mesh, t) && !is_marked(mesh, t) && lies_in(mesh, t, p); });
}

TEST(OverVoid, WhatIsShownWithoutTheMarkHasData) {
  const proto::Samples samples = specked(400);
  TileMesh mesh = holed(16, 256, 5, 9);
  mark_over_void(kGround, kPlace, samples, mesh);
  int known = 0;
  for (std::int32_t y = 0; y <= 256; ++y)
    for (std::int32_t x = 0; x <= 256; ++x) {
      if (!shown_unmarked(mesh, {x, y, 0})) continue;
      ++known;
      EXPECT_NE(samples.at(kGround.west(kPlace) + x, kGround.south(kPlace) + y), proto::kNoHeight) << x << " " << y;
    }
  EXPECT_GT(known, 1000) << "a mark on everything tells nothing";
}

TEST(OverVoid, AWindowThatEndsInsideATriangleHasNoMore) {
  proto::Samples samples{kGround.west(kPlace), kGround.south(kPlace), 200, 257, std::vector<std::int32_t>(200 * 257, 7), {}};
  TileMesh mesh = holed(4, 256, 1, 1000);
  mark_over_void(kGround, kPlace, samples, mesh);
  EXPECT_TRUE(shown_unmarked(mesh, {100, 100, 0}));
  EXPECT_FALSE(shown_unmarked(mesh, {195, 100, 0}));
}

TEST(OverVoid, AParentKnowsNoMoreThanTheSurfaceThatItIsMadeOf) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    TileMesh finer = holed(32, 256, seed, 60), mesh = holed(8, 256, seed + 20, 20);
    std::mt19937 random(seed);
    for (auto& mark : finer.mark)
      if (random() % 80 == 0) mark |= kOverVoid;
    mark_over_void(finer, mesh);
    int known = 0;
    for (std::int32_t y = 0; y <= 256; y += 3)
      for (std::int32_t x = 0; x <= 256; x += 3) {
        if (!shown_unmarked(mesh, {x, y, 0})) continue;
        ++known;
        EXPECT_TRUE(shown_unmarked(finer, {x, y, 0})) << x << " " << y;
      }
    EXPECT_GT(known, 50);
  }
}

TEST(OverVoid, AWeldKeepsTheMarkOfEitherSide) {
  TileMesh west = holed(4, 256, 1, 1000), east = west;
  east.mark[5] |= kOverVoid;  // (0, 64): on the common border
  west.mark[6] |= kOverVoid;  // (64, 64)
  const TileMesh both = holed(8, 512, 1, 1000);
  const std::vector<std::uint32_t> marked = marked_over_void({&west, &east, nullptr, nullptr}, both);
  ASSERT_EQ(marked.size(), 2u);
  EXPECT_EQ(both.x[marked[0]], 64);
  EXPECT_EQ(both.x[marked[1]], 256);
  EXPECT_EQ(both.y[marked[1]], 64);
}

TEST(OverVoid, NoPointBetweenVerticesIsOfferedThere) {
  std::mt19937 random(11);
  std::vector<std::int32_t> heights(16);
  int between = 0;
  for (int trial = 0; trial < 200; ++trial) {
    for (auto& height : heights) height = static_cast<std::int32_t>(random() % 300) * 1024;
    TileMesh finer = gpu::grid_mesh(3, 85, heights);
    const std::array<gpu::MeshPoint, 3> asked{{{10, 30, 0}, {200, 20, 200 * 1024}, {150, 210, 0}}};
    const auto offered_between = [&] {
      const gpu::TriangleError error = ComposedMeter(kGround, kPlace, finer, 0, {}, 0x1p-20).measure(asked, 1);
      return std::count_if(error.points.begin(), error.points.begin() + error.count,
                           [](const gpu::MeshPoint& p) { return p.x % 85 != 0 || p.y % 85 != 0; });
    };
    between += static_cast<int>(offered_between());
    for (auto& mark : finer.mark) mark |= kOverVoid;
    EXPECT_EQ(offered_between(), 0);
  }
  EXPECT_GT(between, 20);
}

TEST(ToVoid, IsTheNearerSideStraightAcross) {
  proto::Samples samples = specked(50);
  const std::int64_t west = kGround.west(kPlace), south = kGround.south(kPlace);
  for (const Along along : {Along::east, Along::north}) {
    const Edge line{&kGround, west + (along == Along::east ? 0 : 30), south + (along == Along::east ? 30 : 0), along, 256};
    const std::vector<std::int32_t> found = distances_to_void(samples, line, 10, 240, 40);
    ASSERT_EQ(found.size(), 240u);
    for (std::int64_t k = 0; k < 240; ++k) {
      std::int32_t expected = 41;
      for (std::int32_t d = 40; d >= 0; --d)
        for (const std::int32_t across : {30 - d, 30 + d}) {
          const std::int64_t c = along == Along::east ? 10 + k : across, r = along == Along::east ? across : 10 + k;
          if (c < 0 || r < 0 || samples.at(west + c, south + r) == proto::kNoHeight) expected = d;
        }
      EXPECT_EQ(found[static_cast<std::size_t>(k)], expected) << k;
    }
  }
}

TEST(ToVoid, BeyondAPoleIsNothing) {
  const std::int64_t rows = kGround.rows();
  const proto::Samples samples{0, rows - 10, 257, 11, std::vector<std::int32_t>(257 * 11, 5), {}};
  EXPECT_EQ(distances_to_void(samples, {&kGround, 0, rows - 2, Along::east, 256}, 50, 1, 30), std::vector<std::int32_t>{9});
}

TEST(Cover, CellsThatAreWiderThanTheDataAskForNothing) {
  const proto::TileAddress all{0, 0, 0};
  const auto side = static_cast<std::int32_t>(kGround.tile_units(0));
  TileMesh nothing = gpu::grid_mesh(1, side, std::vector<std::int32_t>(4, 0));
  for (auto& mark : nothing.mark) mark |= proto::kVoid;
  const proto::Samples small{side / 2, side / 2, 20, 20, std::vector<std::int32_t>(400, 5), {}};
  EXPECT_TRUE(uncovered_inside(kGround, all, nothing, small, part_in_window(kGround, all, small)).empty());
  const proto::TileAddress fine{12, (side / 2) / 256, (side / 2) / 256};
  TileMesh bare = holed(4, 256, 1, 1);
  EXPECT_EQ(uncovered_inside(kGround, fine, bare, small, part_in_window(kGround, fine, small)).size(), 18u * 18u);
}

}  // namespace
}  // namespace cordillera::pipeline
