// Addresses and the one lattice: where tiles are, how they nest, what fits into 32 bits.
#include "proto/lattice.h"

#include <gtest/gtest.h>

#include <random>

namespace cordillera::proto {
namespace {

Lattice lattice(int finest_level) { return {finest_level}; }

/// Tiles of all levels, the corners of the address range first.
std::vector<TileAddress> some_tiles(int levels) {
  std::mt19937 random(7);
  std::vector<TileAddress> tiles;
  for (int z = 0; z < levels; ++z) {
    const std::int32_t across = tiles_across(z), up = tiles_up(z);
    for (const std::int32_t x : {0, across - 1, static_cast<std::int32_t>(random() % static_cast<unsigned>(across))})
      for (const std::int32_t y : {0, up - 1, static_cast<std::int32_t>(random() % static_cast<unsigned>(up))})
        tiles.push_back({z, x, y});
  }
  return tiles;
}

TEST(Lattice, HasTwoRootsAndDoublesALevel) {
  EXPECT_EQ(lattice(0).columns(), 512);
  EXPECT_EQ(lattice(0).rows(), 256);
  for (int z = 0; z <= kMaxLevel; ++z) {
    EXPECT_EQ(lattice(z).columns(), lattice(0).columns() << z);
    EXPECT_EQ(lattice(z).rows(), lattice(0).rows() << z);
    EXPECT_EQ(tiles_across(z), 2 << z);
    EXPECT_EQ(tiles_up(z), 1 << z);
    EXPECT_EQ(lattice(z).tile_units(z), kTileCells);
    EXPECT_EQ(lattice(z).cell_units(z), 1);
  }
}

TEST(Lattice, FitsInto32Bits) {
  const Lattice finest = lattice(kMaxLevel);
  EXPECT_LT(finest.tile_units(0), std::int64_t{1} << 31);
  EXPECT_LE(2 * finest.columns() - 1, INT32_MAX);  // a window over the antimeridian, wrapped once
}

TEST(Lattice, KnowsLongitudesAndLatitudes) {
  for (const int z : {0, 5, 14, kMaxLevel}) {
    const Lattice l = lattice(z);
    EXPECT_EQ(l.longitude_deg(0), -180);
    EXPECT_EQ(l.longitude_deg(l.columns() / 4), -90);
    EXPECT_EQ(l.longitude_deg(l.columns() / 2), 0);
    EXPECT_EQ(l.longitude_deg(l.columns()), 180);
    EXPECT_EQ(l.longitude_deg(l.columns() * 5 / 4), 270);  // outside the circle: not wrapped
    EXPECT_EQ(l.longitude_deg(-l.columns() / 4), -270);
    EXPECT_EQ(l.latitude_deg(0), -90);
    EXPECT_EQ(l.latitude_deg(l.rows() / 2), 0);
    EXPECT_EQ(l.latitude_deg(l.rows()), 90);
    EXPECT_EQ(l.cell_deg() * static_cast<double>(l.rows()), 180);
    EXPECT_DOUBLE_EQ(l.longitude_deg(7) - l.longitude_deg(6), l.cell_deg());
  }
}

TEST(Lattice, OfACoarserLevelIsPartOfTheFiner) {
  std::mt19937 random(3);
  for (int z = 0; z < kMaxLevel; ++z) {
    const auto i = static_cast<std::int64_t>(random()) % lattice(z).columns(),
               j = static_cast<std::int64_t>(random()) % (lattice(z).rows() + 1);
    EXPECT_EQ(lattice(z).longitude_deg(i), lattice(z + 1).longitude_deg(2 * i));
    EXPECT_EQ(lattice(z).latitude_deg(j), lattice(z + 1).latitude_deg(2 * j));
  }
}

TEST(Lattice, TilesCoverTheEarthOnce) {
  const Lattice l = lattice(15);
  for (int z = 0; z <= 15; ++z) {
    EXPECT_EQ(l.west({z, 0, 0}), 0);
    EXPECT_EQ(l.south({z, 0, 0}), 0);
    EXPECT_EQ(l.west({z, tiles_across(z) - 1, 0}) + l.tile_units(z), l.columns());
    EXPECT_EQ(l.south({z, 0, tiles_up(z) - 1}) + l.tile_units(z), l.rows());
    EXPECT_EQ(l.tile_units(z), kTileCells * l.cell_units(z));
  }
  // x = 0 of level 0 is the western hemisphere, y counts from the south.
  EXPECT_EQ(l.longitude_deg(l.west({0, 1, 0})), 0);
  EXPECT_EQ(l.latitude_deg(l.south({1, 0, 1})), 0);
  // The finest vertex of the finest level's last tile is not beyond 64 bits' reach by way of 32.
  const Lattice finest = lattice(kMaxLevel);
  EXPECT_EQ(finest.west({kMaxLevel, tiles_across(kMaxLevel) - 1, 0}) + kTileCells, finest.columns());
}

TEST(TileAddress, ChildrenDivideTheirParent) {
  const Lattice l = lattice(20);
  for (const TileAddress& tile : some_tiles(20)) {
    const std::int64_t half = l.tile_units(tile.z + 1);
    EXPECT_EQ(2 * half, l.tile_units(tile.z));
    for (int c = 0; c < 4; ++c) {
      const TileAddress child = tile.child(c);
      EXPECT_EQ(child.parent(), tile);
      EXPECT_EQ(child.z, tile.z + 1);
      EXPECT_EQ(l.west(child), l.west(tile) + (c & 1 ? half : 0)) << "bit 0 is east";
      EXPECT_EQ(l.south(child), l.south(tile) + (c & 2 ? half : 0)) << "bit 1 is north";
      EXPECT_LT(child.x, tiles_across(child.z));
      EXPECT_LT(child.y, tiles_up(child.z));
    }
  }
}

TEST(TileAddress, IsAChildOfItsParent) {
  for (const TileAddress& tile : some_tiles(22)) {
    if (tile.z == 0) continue;
    EXPECT_EQ(tile.parent().child((tile.x & 1) + 2 * (tile.y & 1)), tile);
  }
}

TEST(TileAddress, IsOrderedByLevelFirst) {
  EXPECT_LT((TileAddress{3, 9, 9}), (TileAddress{4, 0, 0}));
  EXPECT_LT((TileAddress{4, 1, 9}), (TileAddress{4, 2, 0}));
  EXPECT_LT((TileAddress{4, 2, 0}), (TileAddress{4, 2, 1}));
  EXPECT_EQ((TileAddress{4, 2, 1}), (TileAddress{4, 2, 1}));
}

}  // namespace
}  // namespace cordillera::proto
