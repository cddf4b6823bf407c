// National height systems, by PROJ and its grids: declared by a raster, or named by a request.
#include <GeographicLib/Geoid.hpp>
#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/datum/geoid.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;

/// National height systems: a grid in PROJ's own format, under the name that PROJ's database gives the one of NAVD88.
class HeightSystem : public RasterTest {
 protected:
  HeightSystem() { setenv("CORDILLERA_GEOIDS", path("grids").c_str(), 1); }
  ~HeightSystem() override { unsetenv("CORDILLERA_GEOIDS"); }
  static double undulation_m(double lon, double lat) { return -20 + 0.5 * (lon + 105) - 0.25 * (lat - 39); }
  /// Points every quarter of a degree from 107 W, 41 N.
  void install_grid() const {
    fs::create_directories(path("grids"));
    Spec grid;
    grid.columns = grid.rows = 17, grid.geotransform = {-107.125, 0.25, 0, 41.125, 0, -0.25};
    grid.crs = "EPSG:6318";
    grid.point = true;
    grid.value = [](int c, int r) { return undulation_m(-107 + 0.25 * c, 41 - 0.25 * r); };
    write(grid, "grids/us_noaa_g2018u0.tif");
  }
  /// 2 x 2 degrees cut small: 0.2 degrees about 105 W, 39 N, of 1,500 units each.
  Spec colorado(const std::string& crs) const {
    Spec spec;
    spec.columns = spec.rows = 20, spec.geotransform = {-105.1, 0.01, 0, 39.1, 0, -0.01};
    spec.crs = crs;
    spec.value = [](int, int) { return 1500.0; };
    return spec;
  }
  void expect_height(raster::Source& source, double above_datum_m) const {
    const proto::Lattice l = lattice(9);
    const auto w = source.window(l);
    const std::int64_t i = (w.west + w.east) / 2, j = (w.south + w.north) / 2;
    EXPECT_NEAR(height_m(source, l, i, j), above_datum_m + undulation_m(l.longitude_deg(i), l.latitude_deg(j)), 0.005);
  }
};

TEST_F(HeightSystem, DeclaredByTheRasterIsTakenToTheEllipsoid) {
  install_grid();
  const auto source = must_open(write(colorado("EPSG:6318+5703")), {});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "NAVD88 height");
  EXPECT_EQ(source->description().vertical_datum_from(), "source");
  EXPECT_EQ(source->description().vertical_grid(), "us_noaa_g2018u0.tif");
  expect_height(*source, 1500);
}

/// The usual form of data of the United States. PROJ has the grid for NAD83(2011), and no exact way from there to NAD83: within a
/// metre on the ground.
TEST_F(HeightSystem, OnAnOlderDatumTakesTheSameGrid) {
  install_grid();
  const auto declared = must_open(write(colorado("EPSG:4269+5703"), "declared.tif"), {});
  ASSERT_TRUE(declared);
  EXPECT_EQ(declared->description().vertical_datum(), "NAVD88 height");
  EXPECT_EQ(declared->description().vertical_grid(), "us_noaa_g2018u0.tif");
  expect_height(*declared, 1500);
  proto::BuildOptions options;
  options.set_vertical_datum("NAVD88");
  Spec utm = colorado("EPSG:26913");
  utm.geotransform = {490000, 1000, 0, 4327000, 0, -1000};
  for (const Spec& spec : {colorado("EPSG:4269"), utm}) {
    SCOPED_TRACE(spec.crs);
    const auto requested = must_open(write(spec, spec.crs.substr(5) + ".tif"), options);
    ASSERT_TRUE(requested);
    EXPECT_EQ(requested->description().vertical_grid(), "us_noaa_g2018u0.tif");
    expect_height(*requested, 1500);
  }
}

TEST_F(HeightSystem, OnAnOlderDatumAsksForTheNewestGridAlone) {
  const auto refused = open(write(colorado("EPSG:4269+5703")), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "geoid-not-found");
  EXPECT_THAT(refused.problem().detail, ::testing::HasSubstr("us_noaa_g2018u0.tif"));
}

TEST_F(HeightSystem, InFeetIsTakenToMetresOnce) {
  install_grid();
  const auto source = must_open(write(colorado("EPSG:6318+6360")), {});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "NAVD88 height (ftUS)");
  expect_height(*source, 1500 * 1200.0 / 3937);
}

/// Of a raster that says nothing of its heights the request says their unit, too; a unit of its band counts more.
TEST_F(HeightSystem, AskedForInFeetIsInFeet) {
  install_grid();
  proto::BuildOptions options;
  options.set_vertical_datum("EPSG:6360");
  Spec dem = colorado("EPSG:6318");
  const auto source = must_open(write(dem), options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().unit(), "US survey foot");
  expect_height(*source, 1500 * 1200.0 / 3937);
  dem.unit = "m";
  expect_height(*must_open(write(dem, "metres.tif"), options), 1500);
  expect_height(*must_open(write(colorado("EPSG:6318+5703"), "declared.tif"), options), 1500);
}

TEST_F(HeightSystem, IsNamedByTheRequestInManyWays) {
  install_grid();
  const std::string dem = write(colorado("EPSG:6318"));
  for (const char* name : {"NAVD88", "navd88 height", "NAVD 88", "navd_88", "EPSG:5703", "epsg:5703", "5703", "EPSG:6349",
                           "EPSG:6318+5703"}) {  // the last two are compound
    SCOPED_TRACE(name);
    proto::BuildOptions options;
    options.set_vertical_datum(name);
    const auto source = must_open(dem, options, raster::Trust::posted_file, "dem.tif");
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().vertical_datum(), "NAVD88 height");
    EXPECT_EQ(source->description().vertical_datum_from(), "request");
    expect_height(*source, 1500);
  }
}

TEST_F(HeightSystem, WithoutItsGridIsRefusedByName) {
  const auto refused = open(write(colorado("EPSG:6318+5703")), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "geoid-not-found");
  EXPECT_THAT(refused.problem().detail, ::testing::HasSubstr("us_noaa_g2018u0.tif"));
  EXPECT_THAT(refused.problem().detail, ::testing::HasSubstr("NAVD88 height"));
  EXPECT_THAT(refused.problem().accepted,
              ::testing::AllOf(::testing::HasSubstr(path("grids")), ::testing::HasSubstr("vertical_datum=EGM96")));
}

/// EGM96 in place of the system asked for says nothing of feet and depths: the advice must say it.
TEST_F(HeightSystem, WithoutItsGridTellsTheUnitThatIsLostWithIt) {
  const auto advice = [&](const std::string& datum, const Spec& dem, double z_scale = 1) {
    proto::BuildOptions options;
    options.set_vertical_datum(datum);
    if (z_scale != 1) options.set_z_scale(z_scale);
    const auto refused = open(write(dem), options);
    return refused.ok() ? "" : refused.problem().accepted;
  };
  Spec dem = colorado("EPSG:6318");
  EXPECT_THAT(advice("EPSG:6360", dem), ::testing::HasSubstr("with EGM96 z_scale=0.3048006096, too"));
  EXPECT_THAT(advice("EPSG:6358", dem), ::testing::HasSubstr("with EGM96 z_scale=-0.3048006096, too"));
  EXPECT_THAT(advice("EPSG:6360", dem, 2), ::testing::HasSubstr("with EGM96 z_scale=0.6096012192, too"));
  EXPECT_THAT(advice("EPSG:5703", dem), ::testing::Not(::testing::HasSubstr("z_scale")));
  EXPECT_THAT(advice("EPSG:6360", colorado("EPSG:6318+6360")), ::testing::Not(::testing::HasSubstr("z_scale")))
      << "the raster says its unit itself";
  dem.unit = "m";
  EXPECT_THAT(advice("EPSG:6360", dem), ::testing::Not(::testing::HasSubstr("z_scale")));
  EXPECT_THAT(advice("EPSG:6357", dem), ::testing::HasSubstr("with EGM96 z_scale=-1, too"));
  EXPECT_THAT(advice("EPSG:6360", Spec()), ::testing::HasSubstr("with EGM96 z_scale=0.3048006096, too")) << "of another place";
}

/// The operator's folders are nobody's business who posts.
TEST_F(HeightSystem, WithoutItsGridTellsWhoPostedOfNoFolder) {
  const auto refused = open(write(colorado("EPSG:6318+5703")), {}, raster::Trust::posted_file, "dem.tif");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "geoid-not-found");
  EXPECT_THAT(refused.problem().line(),
              ::testing::AllOf(::testing::HasSubstr("CORDILLERA_GEOIDS"), ::testing::Not(::testing::HasSubstr(path("")))));
}

TEST_F(HeightSystem, IsOverruledByTheRequestAndStillTold) {
  proto::BuildOptions options;
  options.set_vertical_datum("EGM96");
  const auto source = must_open(write(colorado("EPSG:6318+5703")), options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "EGM96");
  EXPECT_EQ(source->description().vertical_datum_declared(), "NAVD88 height");
}

/// PROJ's database of that time names what was published; the package that is installed has it in PROJ's own format under another
/// name.
TEST_F(HeightSystem, OfGermanyTakesTheGridOfItsNewerName) {
  fs::create_directories(path("grids"));
  Spec dem;
  dem.columns = dem.rows = 20, dem.geotransform = {10, 0.01, 0, 50, 0, -0.01};
  dem.crs = "EPSG:4258+7837";
  const std::string file = write(dem);
  const auto missing = open(file, {});
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.problem().type, "geoid-not-found");
  EXPECT_THAT(missing.problem().detail, ::testing::HasSubstr("de_bkg_gcg2016.tif (https://cdn.proj.org/"));
  Spec grid;
  grid.columns = grid.rows = 9, grid.geotransform = {9.375, 0.25, 0, 51.125, 0, -0.25};
  grid.crs = "EPSG:4258", grid.point = true;
  grid.value = [](int c, int r) { return 45 + 0.25 * c - 0.125 * r; };
  write(grid, "grids/de_bkg_gcg2016.tif");
  const auto source = must_open(file, {});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "DHHN2016 height");
  EXPECT_EQ(source->description().vertical_grid(), "de_bkg_gcg2016.tif");
  const proto::Lattice l = lattice(9);
  const auto w = source->window(l);
  const std::int64_t i = (w.west + w.east) / 2, j = (w.south + w.north) / 2;
  EXPECT_NEAR(height_m(*source, l, i, j), 100 + 45 + (l.longitude_deg(i) - 9.5) - 0.5 * (51 - l.latitude_deg(j)), 0.005);
}

/// Mean sea level with no word about which: PROJ's database leads it to a grid that PROJ cannot read.
TEST_F(HeightSystem, OfMeanSeaLevelIsEgm96AndTold) {
  for (const auto& [crs, height] : {std::pair{"EPSG:4326+5714", 100.0}, {"EPSG:4326+5715", -100.0}}) {
    SCOPED_TRACE(crs);
    Spec dem;
    dem.crs = crs;
    const auto source = must_open(write(dem), {});
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().vertical_datum(), "EGM96");
    EXPECT_EQ(source->description().vertical_datum_from(), "default");
    EXPECT_THAT(source->description().vertical_datum_declared(), ::testing::HasSubstr("MSL"));
    const proto::Lattice l = lattice(9);
    const auto w = source->window(l);
    const GeographicLib::Geoid geoid("egm96-15", fs::path(raster::egm96_path()).parent_path().string());
    EXPECT_NEAR(height_m(*source, l, w.west, w.south), height + geoid(l.latitude_deg(w.south), l.longitude_deg(w.west)), 0.001);
  }
  proto::BuildOptions options;
  options.set_vertical_datum("EPSG:5714");
  const auto asked = must_open(write({}), options);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->description().vertical_datum(), "EGM96");
  EXPECT_EQ(asked->description().vertical_datum_from(), "request");
}

TEST_F(HeightSystem, OfAnotherPlaceIsNotAdvisedAgain) {
  proto::BuildOptions options;
  options.set_vertical_datum("NAVD88");
  const auto refused = open(write({}), options);  // at 10 E, 45 N
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "geoid-not-found");
  EXPECT_THAT(refused.problem().detail, ::testing::HasSubstr("NAVD88 height"));
  EXPECT_THAT(refused.problem().accepted,
              ::testing::AllOf(::testing::HasSubstr("EGM96"), ::testing::Not(::testing::HasSubstr("NAVD88")),
                               ::testing::Not(::testing::HasSubstr("5703"))));
}

TEST_F(HeightSystem, WhoseGridEndsBeforeTheDataIsRefused) {
  install_grid();
  Spec wide = colorado("EPSG:6318+5703");
  wide.geotransform = {-108, 0.1, 0, 39.1, 0, -0.01};
  EXPECT_EQ(problem_type(write(wide), {}), "geoid-does-not-cover");
}

}  // namespace
}  // namespace cordillera::raster_test
