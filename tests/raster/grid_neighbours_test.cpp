// Rasters of one grid that lie on each other in part: which of a raster's pixels another reads across its side.
#include "raster/mosaic/grid_neighbours.h"

#include <memory>

#include <gtest/gtest.h>

#include "raster/pixels/decimation.h"

namespace cordillera::raster_test {
namespace {

using raster::MosaicMember;

constexpr int kPixels = 100;

/// A square of pixels whose first lies at a pixel of a grid of 30 m.
MosaicMember square_at(int column, int row, int pixels = kPixels) {
  MosaicMember member;
  member.description.set_crs("EPSG:32633");
  member.description.set_columns(static_cast<std::uint32_t>(pixels));
  member.description.set_rows(static_cast<std::uint32_t>(pixels));
  member.description.set_pixel_width_m(30);
  member.description.set_pixel_height_m(30);
  for (const double bound : {15.0, 47.0, 15.1, 47.1}) member.description.add_bbox(bound);
  member.window = {1000, 1000, 2000, 2000};
  member.grid = {500000 + 30.0 * column, 5200000 - 30.0 * row, 30, -30, 0};
  return member;
}

TEST(GridNeighbours, ReadPixelsBeyondTheirSidesAlone) {
  std::vector<MosaicMember> members{square_at(0, 0), square_at(60, 20), square_at(10, 10, 20), square_at(60, 20)};
  members.back().description.set_crs("EPSG:32632");
  raster::GridNeighbours neighbours(members, {});
  // The second one's first pixel is the first one's 60th in its 20th row.
  EXPECT_FALSE(neighbours.reads_across(0, 1, {0, 0}));
  EXPECT_FALSE(neighbours.reads_across(0, 1, {39, 79}));
  EXPECT_TRUE(neighbours.reads_across(0, 1, {40, 79}));
  EXPECT_TRUE(neighbours.reads_across(0, 1, {39, 80}));
  EXPECT_FALSE(neighbours.reads_across(1, 0, {60, 20}));
  EXPECT_TRUE(neighbours.reads_across(1, 0, {59, 20}));
  EXPECT_TRUE(neighbours.reads_across(1, 0, {60, 19}));
  EXPECT_FALSE(neighbours.reads_across(0, 2, {0, 0})) << "it lies within";
  EXPECT_TRUE(neighbours.goes_on(2, 0));
  EXPECT_TRUE(neighbours.reads_across(2, 0, {30, 10}));
  EXPECT_FALSE(neighbours.goes_on(0, 3)) << "another grid";
  EXPECT_FALSE(neighbours.reads_across(0, 3, {99, 99}));
}

/// A pixel of a raster that is thinned out stands for ten by ten.
TEST(GridNeighbours, OfOnesThatAreThinnedOut) {
  std::vector<MosaicMember> members{square_at(0, 0), square_at(60, 20)};
  for (MosaicMember& member : members) {
    auto few = std::make_shared<raster::Decimation>();
    few->columns = few->rows = 10;
    few->covered_columns = kPixels;
    member.decimation = few;
  }
  raster::GridNeighbours neighbours(members, {});
  EXPECT_FALSE(neighbours.reads_across(0, 1, {3, 7}));
  EXPECT_TRUE(neighbours.reads_across(0, 1, {4, 7}));
  EXPECT_TRUE(neighbours.reads_across(0, 1, {3, 8}));
  EXPECT_TRUE(neighbours.reads_across(1, 0, {5, 2}));
  EXPECT_FALSE(neighbours.reads_across(1, 0, {6, 2}));
}

TEST(GridNeighbours, OfAnotherSheetAreNone) {
  const std::vector<MosaicMember> members{square_at(0, 0), square_at(60, 20)};
  const std::vector<std::size_t> sheets{0, 1};
  raster::GridNeighbours neighbours(members, sheets);
  EXPECT_FALSE(neighbours.goes_on(0, 1));
}

}  // namespace
}  // namespace cordillera::raster_test
