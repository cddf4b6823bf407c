// A raster thinned out lies where the raster lies, has its heights and its voids.
#include "raster/pixels/decimation.h"

#include <cmath>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

/// A plane, so that a height tells a place; pixels of the cells of level 8 at a corner of its tiles.
Spec plane(int side) {
  Spec spec;
  spec.columns = spec.rows = side;
  spec.geotransform = cells_of(8, 69120, 49152);
  spec.value = [](int c, int r) { return 100 + 0.5 * c + 0.25 * r; };
  return spec;
}

using Decimated = RasterTest;

std::unique_ptr<raster::Source> thin(const std::string& path, std::int64_t most, raster::Decimation* pixels = nullptr) {
  const auto source = must_open(path);
  if (!source) return nullptr;
  auto taken = source->decimate(most);
  EXPECT_TRUE(taken.ok() && *taken != nullptr) << (taken.ok() ? "" : taken.problem().line());
  if (!taken.ok() || *taken == nullptr) return nullptr;
  if (pixels != nullptr) *pixels = **taken;
  auto opened = raster::open_decimated(path, "", raster::Trust::operator_file, plain_options(), **taken);
  EXPECT_TRUE(opened.ok()) << (opened.ok() ? "" : opened.problem().line());
  return opened.ok() ? std::move(*opened) : nullptr;
}

TEST_F(Decimated, LiesWhereTheRasterLies) {
  const std::string path = write(plane(512));
  raster::Decimation pixels;
  const auto few = thin(path, 64 * 64, &pixels);
  const auto all = must_open(path);
  ASSERT_TRUE(few && all);
  EXPECT_EQ(pixels.columns, 64);
  EXPECT_EQ(pixels.rows, 64);
  EXPECT_EQ(pixels.of.columns(), 512u);
  const auto w = all->window(lattice(5)), v = few->window(lattice(5));
  EXPECT_EQ(w.west, v.west);
  EXPECT_EQ(w.south, v.south);
  EXPECT_EQ(w.east, v.east);
  EXPECT_EQ(w.north, v.north);
  for (const int k : {10, 30, 50}) EXPECT_NEAR(height_m(*few, lattice(5), w.west + k, w.south + k), height_m(*all, lattice(5), w.west + k, w.south + k), 8 * 0.5) << k;
}

TEST_F(Decimated, ValuesMaskedOutStayOut) {
  Spec spec = plane(256);
  spec.mask = [](int c, int) { return c < 128; };
  const auto few = thin(write(spec), 32 * 32);
  ASSERT_TRUE(few);
  const double share = valid_share(whole(*few, lattice(5)));
  EXPECT_GT(share, 0.4);
  EXPECT_LT(share, 0.6);
}

TEST_F(Decimated, BlocksThatWereNeverWrittenAreVoid) {
  Spec spec = plane(1024);
  spec.create = {"SPARSE_OK=TRUE", "TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128", "COMPRESS=DEFLATE"};
  spec.only = Spec::Part{256, 256, 512};
  const auto few = thin(write(spec), 64 * 64);
  ASSERT_TRUE(few);
  EXPECT_NEAR(valid_share(whole(*few, lattice(4))), 0.25, 0.05);
}

TEST_F(Decimated, ANodataValueIsKept) {
  Spec spec = plane(256);
  spec.nodata = -9999;
  spec.value = [](int c, int) { return c < 64 ? -9999.0 : 100.0; };
  const auto few = thin(write(spec), 64 * 64);
  ASSERT_TRUE(few);
  EXPECT_NEAR(valid_share(whole(*few, lattice(6))), 0.75, 0.03);
}

TEST_F(Decimated, AWholeCircleStaysOne) {
  Spec spec;
  spec.columns = 361, spec.rows = 180;  // its last column is the first again
  spec.geotransform = {-180.5, 1, 0, 90, 0, -1};
  raster::Decimation pixels;
  const auto few = thin(write(spec), 90 * 45, &pixels);
  ASSERT_TRUE(few);
  EXPECT_EQ(pixels.covered_columns, 360);
  EXPECT_EQ(few->description().bbox(0), -180);
  EXPECT_EQ(few->description().bbox(2), 180);
}

TEST_F(Decimated, TooMuchToDecodeIsRefused) {
  const auto source = must_open(write(huge_sparse(50000)));
  ASSERT_TRUE(source);
  const auto taken = source->decimate(512 * 512);
  ASSERT_FALSE(taken.ok());
  EXPECT_EQ(taken.problem().type, "raster-too-large");
}

}  // namespace
}  // namespace cordillera::raster_test
