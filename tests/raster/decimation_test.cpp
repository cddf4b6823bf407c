// A raster thinned out lies where the raster lies, has its heights and its voids.
#include "raster/pixels/decimation.h"

#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/voids/filled_source.h"

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
  auto opened = raster::open_decimated(path, "", raster::Trust::operator_file, plain_options(), *taken);
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
  for (const int k : {10, 30, 50})
    EXPECT_NEAR(height_m(*few, lattice(5), w.west + k, w.south + k), height_m(*all, lattice(5), w.west + k, w.south + k), 8 * 0.5)
        << k;
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

/// What is said of a raster's values, at all of its pixels.
raster::ValueLook look(const std::string& path, const proto::BuildOptions& options = plain_options()) {
  const auto source = must_open(path, options);
  const auto taken = source ? source->decimate(raster::kPixelsLookedAt) : std::shared_ptr<const raster::Decimation>();
  EXPECT_TRUE(taken.ok() && *taken != nullptr);
  return taken.ok() && *taken != nullptr ? (*taken)->look : raster::ValueLook();
}

TEST_F(Decimated, RangeAndVoidsOfTheValuesAreKnown) {
  Spec spec = plane(64);
  spec.nodata = -9999;
  spec.value = [](int c, int r) { return c < 16 ? -9999.0 : 100 + c + r; };
  const raster::ValueLook seen = look(write(spec));
  EXPECT_TRUE(seen.whole);
  EXPECT_EQ(seen.pixels, 64 * 64);
  EXPECT_EQ(seen.with_height, 48 * 64);
  EXPECT_EQ(seen.lowest_m, 116);
  EXPECT_EQ(seen.highest_m, 226);
  EXPECT_THAT(raster::notes_on(seen), ::testing::IsEmpty());
  EXPECT_EQ(raster::text_of(seen, "EGM96"), "116.00 to 226.00 m above EGM96, 25 % voids, at all pixels");
  EXPECT_FALSE(look(write(plane(1100))).whole);
  const auto filled = raster::open_filled_source(write(spec), "", raster::Trust::operator_file, {});
  ASSERT_TRUE(filled.ok());
  const auto taken = (*filled)->decimate(64);
  EXPECT_TRUE(taken.ok() && *taken != nullptr) << "a source whose voids are filled is of the same raster";
}

TEST_F(Decimated, OfSeveralRastersTheirValuesAreAddedUp) {
  Spec spec = plane(64);
  spec.value = [](int c, int r) { return c < 16 ? -9999.0 : 100 + c + r; };
  raster::ValueLook all;
  raster::add(look(write(spec)), all);
  spec.nodata = -9999;
  raster::add(look(write(spec)), all);
  spec.nodata.reset(), spec.value = [](int, int) { return 400.0; };
  raster::add(look(write(spec)), all);
  EXPECT_EQ(raster::text_of(all, "EGM96"), "-9999.00 to 400.00 m above EGM96, 8.3 % voids, at all pixels");
  EXPECT_THAT(raster::notes_on(all), ::testing::ElementsAre(::testing::HasSubstr("9.1 % of the values are -9999")));
  raster::add(look(write(plane(1100))), all);
  EXPECT_THAT(raster::text_of(all, "EGM96"), ::testing::HasSubstr("pixels spread over the rasters"));
}

TEST_F(Decimated, AValueThatMayMeanNoDataIsNoted) {
  Spec spec = plane(64);
  spec.value = [](int c, int r) { return c < 16 ? -9999.0 : 100 + c + r; };
  EXPECT_THAT(raster::notes_on(look(write(spec))),
              ::testing::ElementsAre("25 % of the values are -9999, which may mean no data and is not declared: they are heights "
                                     "here; nodata=-9999 leaves them out"));
  proto::BuildOptions options = plain_options();
  options.set_nodata("-9999");
  EXPECT_THAT(raster::notes_on(look(write(spec), options)), ::testing::IsEmpty());
  spec.value = [](int c, int r) { return -10100.0 + 4 * c + r % 4; };  // the bottom of a trench
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::IsEmpty());
  spec.type = "Int16", spec.value = [](int c, int r) { return c < 16 ? -32768.0 : 1000 + c + r; };
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::IsEmpty()) << "no height in metres, and taken for none";
  spec.scale = 0.1;
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::ElementsAre(::testing::HasSubstr("25 % of the values are -32768")))
      << "decimetres";
}

TEST_F(Decimated, ZerosFarBelowAllOtherHeightsAreNoted) {
  Spec spec = plane(64);
  spec.value = [](int c, int r) { return c < 16 ? 0.0 : 50 + c + r; };
  const std::string note =
      "25 % of the values are 0, and no other height is below 66 m: 0 may mean no data and is not declared; nodata=0 leaves "
      "these "
      "pixels out";
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::ElementsAre(note));
  raster::ValueLook both = look(write(spec));
  proto::BuildOptions options = plain_options();
  options.set_nodata("0");
  EXPECT_THAT(raster::notes_on(look(write(spec), options)), ::testing::IsEmpty());
  spec.value = [](int c, int r) { return c < 16 ? 0.0 : c - 15 + r; };
  const raster::ValueLook coast = look(write(spec));
  EXPECT_THAT(raster::notes_on(coast), ::testing::IsEmpty());
  raster::add(coast, both);
  EXPECT_THAT(raster::notes_on(both), ::testing::IsEmpty()) << "beside a coast";
  spec.value = [](int c, int r) { return c + r == 0 ? 0.0 : 50 + c + r; };
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::IsEmpty()) << "one pixel";
  spec.value = [](int, int) { return 0.0; };
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::IsEmpty()) << "the sea alone";
}

TEST_F(Decimated, HeightsBeyondTheLimitAreNotedWhereTheyAreMany) {
  Spec spec = plane(64);
  spec.value = [](int c, int r) { return 1000.0 * c + r; };  // millimetres, say
  EXPECT_THAT(raster::notes_on(look(write(spec))),
              ::testing::ElementsAre(
                  ::testing::AllOf(::testing::HasSubstr("73 % of the values are heights beyond 16384 m, from 17000 to 63063 m"),
                                   ::testing::HasSubstr("z_scale="))));
  spec.value = [](int c, int r) { return c == 0 && r == 0 ? 40000.0 : c == 0 && r == 1 ? 41000.0 : 100.0; };
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::IsEmpty()) << "two pixels are no good part";
  spec.value = [](int c, int r) { return c < 32 ? 65535.0 : 100.0 + r; };
  EXPECT_THAT(raster::notes_on(look(write(spec))), ::testing::IsEmpty()) << "one value is no data by another name";
}

}  // namespace
}  // namespace cordillera::raster_test
