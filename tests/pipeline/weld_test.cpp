#include "pipeline/tile/weld.h"

#include <gtest/gtest.h>

#include <random>

#include "gpu/mesh/rings.h"
#include "gpu/simplify.h"
#include "pipeline/tile/border.h"
#include "pipeline/tile/void_tile.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera::pipeline {
namespace {

using proto::kNoHeight;
using proto::TileMesh;

Chain random_chain(std::mt19937& random, std::int32_t units, int one_in) {
  Chain chain;
  for (std::int32_t p = 0; p <= units; ++p) {
    const bool end = p == 0 || p == units;
    if (!end && random() % one_in != 0) continue;
    chain.position.push_back(p);
    chain.height.push_back(end ? 7 : random() % 3 == 0 ? kNoHeight : static_cast<std::int32_t>(random() % 1000));
  }
  return chain;
}

std::size_t published(const TileMesh& mesh) {
  std::size_t count = 0;
  for (const auto& t : mesh.triangles) count += is_published(mesh, t) ? 1 : 0;
  return count;
}

TEST(VoidTile, FitsAnyBorder) {
  std::mt19937 random(1);
  for (int round = 0; round < 400; ++round) {
    const std::int32_t side = 8 << (round % 7);
    std::array<Chain, 4> border;
    for (Chain& chain : border) {
      const int density[] = {1, 2, 7, 1000000};
      chain = random_chain(random, side, density[random() % 4]);
    }
    const TileMesh mesh = void_tile(side, border);
    ASSERT_EQ(test::broken_law(mesh), "") << "round " << round << " side " << side;
    const test::Valences most = test::valences(mesh);
    EXPECT_LE(most.inside, 10u);
    EXPECT_LE(most.sides, 6u);
    EXPECT_LE(most.corners, 4u);
    EXPECT_EQ(published(mesh), 0u);
    for (const Side s : {Side::west, Side::east, Side::south, Side::north})
      EXPECT_TRUE(border_chain(mesh, s) == border[static_cast<std::size_t>(s)]) << "round " << round;
    EXPECT_TRUE(gpu::rings_from_triangles(mesh).ok());
  }
}

TEST(VoidTile, WithoutNeighboursIsTwoTriangles) {
  const Chain none = void_chain(256);
  const TileMesh mesh = void_tile(256, {none, none, none, none});
  EXPECT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(test::broken_law(mesh), "");
}

TEST(VoidTile, PublishesNothingWhicheverCornersHaveData) {
  for (int corners = 0; corners < 16; ++corners) {
    const auto at = [&](int x, int y) { return corners >> (x + 2 * y) & 1 ? 5 : kNoHeight; };
    const auto side = [](std::int32_t a, std::int32_t b) { return Chain{{0, 64}, {a, b}, 0}; };
    const TileMesh mesh =
        void_tile(64, {side(at(0, 0), at(0, 1)), side(at(1, 0), at(1, 1)), side(at(0, 0), at(1, 0)), side(at(0, 1), at(1, 1))});
    EXPECT_EQ(test::broken_law(mesh), "");
    EXPECT_EQ(published(mesh), 0u) << corners;
  }
}

TEST(VoidTile, LongestSidesStayInIntegers) {
  const std::int32_t side = 1 << 29;
  Chain dense = void_chain(side);
  dense.position = {0, 1, 2, 3, side - 2, side - 1, side};
  dense.height.assign(7, kNoHeight);
  const Chain none = void_chain(side);
  const TileMesh mesh = void_tile(side, {dense, none, none, dense});
  EXPECT_EQ(test::broken_law(mesh), "");
}

TileMesh grid(std::int32_t cells, std::int32_t step, std::int32_t east, std::int32_t north) {
  std::vector<std::int32_t> heights;
  for (std::int32_t j = 0; j <= cells; ++j)
    for (std::int32_t i = 0; i <= cells; ++i) {
      const std::int32_t x = east + i * step, y = north + j * step;
      heights.push_back((x * 31 + y * 17) % 5 == 0 ? kNoHeight : x * 100 + y);
    }
  return gpu::grid_mesh(cells, step, heights);
}

TEST(Weld, AnyChildrenMayBeMissing) {
  constexpr std::int32_t kSide = 32;
  std::array<TileMesh, 4> tiles;
  for (int c = 0; c < 4; ++c) tiles[c] = grid(16, 2, (c & 1) * kSide, (c >> 1) * kSide);
  for (int there = 0; there < 16; ++there) {
    WeldInput input;
    input.child_side = kSide;
    std::size_t want = 0;
    for (int c = 0; c < 4; ++c) {
      if (!(there >> c & 1)) continue;
      input.children[c] = &tiles[c];
      want += published(tiles[c]);
    }
    const auto parent = weld(input);
    ASSERT_TRUE(parent.ok()) << parent.problem().detail;
    EXPECT_EQ(test::broken_law(*parent), "") << there;
    EXPECT_EQ(published(*parent), want) << there;
    EXPECT_EQ(parent.value().side, 2 * kSide);
    EXPECT_TRUE(gpu::rings_from_triangles(*parent).ok());
    const test::Valences most = test::valences(*parent);
    EXPECT_LE(most.inside, 14u);
    EXPECT_LE(most.corners, 4u);
    std::size_t kept = 0;
    for (const std::uint8_t mark : parent.value().mark) kept += mark & proto::kKeep ? 1 : 0;
    EXPECT_EQ(kept, 4u);
  }
}

TEST(Weld, FourGridsMakeTheGrid) {
  std::array<TileMesh, 4> tiles;
  for (int c = 0; c < 4; ++c) tiles[c] = grid(16, 2, (c & 1) * 32, (c >> 1) * 32);
  const auto parent = weld({{&tiles[0], &tiles[1], &tiles[2], &tiles[3]}, 32, {}});
  ASSERT_TRUE(parent.ok());
  const TileMesh whole = grid(32, 2, 0, 0);
  EXPECT_EQ(parent.value().vertices(), whole.vertices());
  const auto corners_of = [](const TileMesh& m) {
    std::set<std::array<std::array<std::int32_t, 3>, 3>> all;
    for (const auto& t : m.triangles) {
      std::array<std::array<std::int32_t, 3>, 3> points;
      for (int k = 0; k < 3; ++k) points[k] = {m.x[t[k]], m.y[t[k]], is_void(m, t[k]) ? kNoHeight : m.height[t[k]]};
      std::sort(points.begin(), points.end());
      all.insert(points);
    }
    return all;
  };
  EXPECT_EQ(corners_of(*parent), corners_of(whole));
}

TEST(Weld, RefusesBordersThatDiffer) {
  std::array<TileMesh, 4> tiles;
  for (int c = 0; c < 4; ++c) tiles[c] = grid(16, 2, (c & 1) * 32, (c >> 1) * 32);
  const WeldInput input{{&tiles[0], &tiles[1], &tiles[2], &tiles[3]}, 32, {}};
  const auto west = side_vertices(tiles[1], Side::west);
  tiles[1].mark[west[3]] ^= proto::kVoid;
  EXPECT_EQ(weld(input).problem().type, "weld-mismatch");
  tiles[1].mark[west[3]] ^= proto::kVoid;
  tiles[1].height[west[4]] += 1;
  EXPECT_FALSE(weld(input).ok());
  tiles[1].height[west[4]] -= 1;
  EXPECT_TRUE(weld(input).ok());
}

TEST(Weld, OuterNeighboursOfAMissingChildAreMet) {
  Chain outside = void_chain(32);
  outside.position = {0, 5, 6, 7, 32};
  outside.height = {kNoHeight, 1, 2, 3, kNoHeight};
  const TileMesh east = grid(16, 2, 32, 0);
  WeldInput input;
  input.child_side = 32;
  input.children[1] = &east;
  input.outer[0][static_cast<std::size_t>(Side::west)] = &outside;
  const auto parent = weld(input);
  ASSERT_TRUE(parent.ok()) << parent.problem().detail;
  EXPECT_EQ(test::broken_law(*parent), "");
  EXPECT_EQ(border_chain(*parent, Side::west).position, (std::vector<std::int32_t>{0, 5, 6, 7, 32, 64}));
}

TEST(Border, ChainMarksItsSide) {
  TileMesh mesh = grid(16, 2, 0, 0);
  Chain chain = border_chain(mesh, Side::east);
  ASSERT_EQ(chain.position.size(), 17u);
  chain.position = {0, 10, 32};
  chain.height = {chain.height[0], chain.height[5], chain.height[16]};
  ASSERT_TRUE(apply_chain(mesh, Side::east, chain).ok());
  std::size_t keep = 0, gone = 0;
  for (const std::uint32_t v : side_vertices(mesh, Side::east)) {
    keep += mesh.mark[v] & proto::kKeep ? 1 : 0;
    gone += mesh.mark[v] & proto::kRemove ? 1 : 0;
  }
  EXPECT_EQ(keep, 3u);
  EXPECT_EQ(gone, 14u);
  chain.position[1] = 11;
  EXPECT_EQ(apply_chain(mesh, Side::east, chain).problem().type, "chain-not-in-mesh");
  chain.position[1] = 10;
  chain.height[1] += 1;
  EXPECT_FALSE(apply_chain(mesh, Side::east, chain).ok());
}

}  // namespace
}  // namespace cordillera::pipeline
