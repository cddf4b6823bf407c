// Rasters that give way to those below them: where they do, and whose pixels count there.
#include <cmath>

#include "raster/mosaic/mosaic.h"
#include "raster/mosaic/sheets.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

constexpr int kFine = 12;
constexpr std::int64_t kSheetWest = 900000, kSheetNorth = 700000;
constexpr double kFineCell_m = 111000.0 * 180 / (256 << kFine), kFeather_m = 20 * kFineCell_m;

class Feather : public RasterTest {
 protected:
  /// All of one height, pixels being cells of a lattice; east and south of the corner, in cells of the fine one.
  raster::MosaicMember flat(const std::string& name, int east, int south, int columns, int rows, double height, int coarser = 0) {
    Spec spec;
    spec.columns = columns >> coarser, spec.rows = rows >> coarser;
    spec.geotransform = cells_of(kFine - coarser, (kSheetWest + east) >> coarser, (kSheetNorth - south) >> coarser);
    spec.value = [height](int, int) { return height; };
    const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options());
    EXPECT_TRUE(member.ok()) << member.problem().line();
    return *member;
  }
  double at(raster::Source& source, int east, int south) {
    return height_m(source, lattice(kFine), kSheetWest + east, kSheetNorth - south);
  }
};

/// Two sheets of one map on a coarse model: nothing gives way where the map goes on.
TEST_F(Feather, is_around_a_map_and_not_around_each_of_its_sheets) {
  const auto west = flat("west.tif", 0, 0, 64, 128, 100), east = flat("east.tif", 64, 0, 64, 128, 100),
             below = flat("below.tif", -64, -64, 256, 256, 300, 2);
  for (const auto& members : {std::vector{west, east, below}, std::vector{east, west, below}}) {
    const auto source = raster::make_mosaic(members, kFeather_m);
    for (int column = 30; column <= 98; ++column) EXPECT_EQ(at(*source, column, 64), 100) << column;
    EXPECT_GT(at(*source, 2, 64), 250) << "at the map's own rim";
    EXPECT_GT(at(*source, 126, 64), 250);
  }
  EXPECT_EQ(raster::sheets_of({west, east, below}), (std::vector<std::size_t>{0, 0, 2}));
}

TEST_F(Feather, does_not_see_the_sheets_of_the_map_below) {
  // Of the grid of the one above, which has other heights where they meet.
  const auto above = flat("above.tif", 0, 0, 64, 128, 300, 1);
  const auto whole = raster::make_mosaic({above, flat("all.tif", -64, -64, 256, 256, 100, 1)}, kFeather_m);
  const auto cut = raster::make_mosaic(
      {above, flat("north.tif", -64, -64, 256, 128, 100, 1), flat("south.tif", -64, 64, 256, 128, 100, 1)}, kFeather_m);
  for (int row = 50; row <= 78; ++row) EXPECT_EQ(at(*cut, 58, row), at(*whole, 58, row)) << row;
}

/// A survey on a model that it was made for is no sheet of it.
TEST_F(Feather, is_around_a_patch_of_the_same_grid) {
  const auto patch = flat("patch.tif", 40, 40, 80, 80, 100), base = flat("base.tif", 0, 0, 160, 160, 300);
  EXPECT_EQ(raster::sheets_of({patch, base}), (std::vector<std::size_t>{0, 1}));
  const auto source = raster::make_mosaic({patch, base}, kFeather_m);
  EXPECT_EQ(at(*source, 80, 80), 100);
  EXPECT_GT(at(*source, 43, 80), 240);
  EXPECT_EQ(raster::sheets_of({flat("a.tif", 0, 0, 64, 64, 1), base, flat("b.tif", 64, 0, 64, 64, 1)}),
            (std::vector<std::size_t>{0, 1, 2}))
      << "others between them win over the second";
}

/// Only where two rasters are mixed is a pixel of neither part of the surface.
TEST_F(Feather, takes_away_the_pixels_of_its_own_width_alone) {
  const auto source =
      raster::make_mosaic({flat("a.tif", 0, 0, 128, 128, 100), flat("b.tif", -64, -64, 256, 256, 300, 2)}, kFeather_m);
  const raster::Source::Window cells{kSheetWest, kSheetNorth - 128, kSheetWest + 128, kSheetNorth};
  const auto pixels = source->pixels(lattice(kFine), cells);
  ASSERT_TRUE(pixels.ok());
  std::size_t inside = 0, near_the_rim = 0;
  for (const raster::PixelPoint& pixel : *pixels) {
    const double from_rim = std::min({pixel.x, 128 - pixel.x, pixel.y, 128 - pixel.y});
    ++(from_rim > 19 ? inside : near_the_rim);
    EXPECT_EQ(pixel.height_m, 100) << pixel.x << " " << pixel.y;
  }
  EXPECT_GE(inside, 86u * 86);
  EXPECT_EQ(near_the_rim, 0u);
}

/// As each of them states it, not as the lattice's vertices in it lie.
TEST_F(Feather, a_mosaics_box_is_that_of_its_members) {
  Spec spec;
  spec.columns = spec.rows = 40;
  spec.crs = "EPSG:32632";
  spec.geotransform = {500000, 100, 0, 5000000, 0, -100};
  const auto one = raster::examine(write(spec, "utm.tif"), "utm.tif", raster::Trust::operator_file, plain_options());
  ASSERT_TRUE(one.ok());
  const auto twice = raster::make_mosaic({*one, *one}, 0);
  for (int side = 0; side < 4; ++side) EXPECT_NEAR(twice->description().bbox(side), one->description.bbox(side), 1e-12);
}

}  // namespace
}  // namespace cordillera::raster_test
