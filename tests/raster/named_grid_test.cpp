// Geoid grids that a CRS names by itself.
#include <ogr_spatialref.h>

#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>

#include "geoid_fixture.h"
#include "raster/datum/geoid.h"
#include "raster/place/crs.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;

/// +geoidgrids= of a PROJ string, PROJ4_GRIDS of WKT: a grid that the CRS itself names.
class NamedGrid : public WithGeoid {
 protected:
  NamedGrid() {
    grid_ = write_geoid("own.tif");
    Spec bare;
    bare.columns = bare.rows = 80, bare.crs = "";
    dem_ = write(bare);
  }
  ~NamedGrid() override { unsetenv("CORDILLERA_GEOIDS"); }
  void install() const { setenv("CORDILLERA_GEOIDS", fs::path(grid_).parent_path().c_str(), 1); }
  static proto::BuildOptions with_crs(const std::string& crs) {
    proto::BuildOptions options;
    options.set_crs(crs);
    return options;
  }
  static std::string degrees(const std::string& grids) { return "+proj=longlat +datum=WGS84 +geoidgrids=" + grids; }
  static void expect_height(raster::Source& source, double above_grid_m) {
    const proto::Lattice l = lattice(7);
    const auto w = source.window(l);
    const double lon = l.longitude_deg(w.west + 3), lat = l.latitude_deg(w.south + 5);
    EXPECT_NEAR(height_m(source, l, w.west + 3, w.south + 5), above_grid_m - 60 + lon + 2 * lat, 0.01);
  }
  std::string grid_, dem_;
};

TEST_F(NamedGrid, IsTakenWhereItIsAtHand) {
  install();
  const std::string wkt =
      R"(COMPD_CS["local",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
      R"(UNIT["degree",0.0174532925199433]],VERT_CS["harbour height",VERT_DATUM["harbour",2005,)"
      R"(EXTENSION["PROJ4_GRIDS","own.tif"]],UNIT["metre",1],AXIS["Up",UP]]])";
  for (const std::string& crs : {degrees("own.tif"), degrees("@nowhere.gtx,own.tif"), degrees(grid_), wkt}) {
    SCOPED_TRACE(crs);
    const auto source = must_open(dem_, with_crs(crs));
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().vertical_datum(), "own.tif");
    EXPECT_EQ(source->description().vertical_datum_from(), "request");
    EXPECT_THAT(source->description().vertical_datum_declared(), ::testing::EndsWith("own.tif"));
    EXPECT_THAT(source->description().vertical_datum_declared(), ::testing::Not(::testing::HasSubstr("/")));
    expect_height(*source, 100);
  }
  const auto feet = must_open(dem_, with_crs(degrees("own.tif") + " +vunits=us-ft"));
  ASSERT_TRUE(feet);
  expect_height(*feet, 100 * 1200.0 / 3937);
  const auto none = must_open(dem_, with_crs(degrees("@null")));
  ASSERT_TRUE(none);
  EXPECT_EQ(none->description().vertical_datum(), "ellipsoid");
}

TEST_F(NamedGrid, OfTheRasterItselfIsTakenToo) {
  install();
  OGRSpatialReference srs;
  ASSERT_EQ(srs.SetFromUserInput(degrees("own.tif").c_str()), OGRERR_NONE);
  const std::string vrt =
      std::string(R"(<VRTDataset rasterXSize="80" rasterYSize="80"><SRS>)") + raster::wkt_of(srs) +
      R"(</SRS><GeoTransform>10, 0.01, 0, 45, 0, -0.01</GeoTransform>)"
      R"(<VRTRasterBand dataType="Float32" band="1"><SimpleSource>)"
      R"(<SourceFilename relativeToVRT="1">dem.tif</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>)";
  const auto source = must_open(write_text(vrt, "own.vrt"), {});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum_from(), "source");
  expect_height(*source, 100);
}

/// What a file is called says nothing of its heights.
TEST_F(NamedGrid, CalledAsADatumIsIsAGrid) {
  install();
  const fs::path folder = fs::path(grid_).parent_path();
  for (const char* const called : {"ellipsoid", "EGM2008", "EGM96", "null", "egm08_25.gtx", "egm96_15.gtx"}) {
    SCOPED_TRACE(called);
    fs::copy_file(grid_, folder / called);
    const auto source = must_open(dem_, with_crs(degrees((folder / called).string())));
    ASSERT_TRUE(source);
    EXPECT_THAT(source->description().vertical_datum(), ::testing::EndsWith(called));
    EXPECT_EQ(source->description().vertical_datum_declared(), source->description().vertical_datum());
    expect_height(*source, 100);
    fs::remove(folder / called);
    if (called == std::string("egm96_15.gtx") || called == std::string("egm08_25.gtx")) continue;
    EXPECT_EQ(problem_type(dem_, with_crs(degrees(called))), called == std::string("null") ? "" : "geoid-not-found");
  }
  fs::copy_file(grid_, folder / "ellipsoid");
  const auto bare = must_open(dem_, with_crs(degrees("ellipsoid")));
  ASSERT_TRUE(bare);
  EXPECT_EQ(bare->description().vertical_datum(), "grid file ellipsoid");
  expect_height(*bare, 100);
}

/// Its own code or name counts where the grid is missing.
TEST_F(NamedGrid, ComesBeforeTheNameOfTheDatum) {
  const std::string wkt =
      R"(COMPD_CS["local",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
      R"(UNIT["degree",0.0174532925199433]],VERT_CS["EGM96 height",VERT_DATUM["EGM96 geoid",2005,)"
      R"(EXTENSION["PROJ4_GRIDS","own.tif"]],UNIT["metre",1],AXIS["Up",UP]]])";
  const auto missing = must_open(dem_, with_crs(wkt));
  ASSERT_TRUE(missing);
  EXPECT_EQ(missing->description().vertical_datum(), "EGM96");
  install();
  const auto source = must_open(dem_, with_crs(wkt));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "own.tif");
  expect_height(*source, 100);
}

/// Many files name it so: with the grid that is at hand for it here, wherever theirs is.
TEST_F(NamedGrid, ThatWasPublishedIsItsDatum) {
  for (const char* const grids : {"egm96_15.gtx", "@egm96_15.gtx", "us_nga_egm96_15.tif", "@nowhere.gtx,egm96_15.gtx"}) {
    SCOPED_TRACE(grids);
    const auto source = must_open(dem_, with_crs(degrees(grids)));
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().vertical_datum(), "EGM96");
    EXPECT_EQ(source->description().vertical_datum_from(), "request");
  }
  const auto lost = must_open(dem_, with_crs(degrees("/nowhere/egm96_15.gtx")));
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->description().vertical_datum(), "EGM96");
  EXPECT_EQ(lost->description().vertical_datum_declared(), "egm96_15.gtx");
  // Of a datum without a grid of its own here, the file itself.
  install();
  fs::copy_file(grid_, fs::path(grid_).parent_path() / "egm08_25.gtx");
  const auto file = must_open(dem_, with_crs(degrees("egm08_25.gtx")));
  ASSERT_TRUE(file);
  EXPECT_EQ(file->description().vertical_datum(), "egm08_25.gtx");
  expect_height(*file, 100);
}

/// Never another in its place.
TEST_F(NamedGrid, ThatIsMissingIsAskedForByName) {
  for (const char* const grids : {"own.tif", "@own.tif", "@nowhere.gtx,own.tif", "own.tif,nowhere.gtx"}) {
    SCOPED_TRACE(grids);
    const auto refused = open(dem_, with_crs(degrees(grids)));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.problem().type, "geoid-not-found");
    EXPECT_THAT(refused.problem().detail, ::testing::HasSubstr("own.tif"));
    EXPECT_THAT(refused.problem().accepted, ::testing::HasSubstr("vertical_datum=EGM96"));
  }
  install();
  const std::string elsewhere = fs::path(write_geoid("elsewhere.tif", 10.3)).filename();
  EXPECT_EQ(problem_type(dem_, with_crs(degrees(elsewhere))), "geoid-does-not-cover");
  EXPECT_EQ(problem_type(dem_, with_crs(degrees(elsewhere + ",own.tif"))), "");
}

/// Who posts a raster reads no file of the machine by it.
TEST_F(NamedGrid, OfAPostedRasterIsOneOfTheOperators) {
  const auto posted = [&](const std::string& grids) {
    return problem_type(dem_, with_crs(degrees(grids)), raster::Trust::posted_file, "dem.tif");
  };
  EXPECT_EQ(posted("own.tif"), "geoid-not-found");
  install();
  EXPECT_EQ(posted("own.tif"), "");
  EXPECT_EQ(posted(grid_), "geoid-not-found");
  EXPECT_EQ(posted("../" + fs::path(grid_).parent_path().filename().string() + "/own.tif"), "geoid-not-found");
}

TEST_F(NamedGrid, AboveAnotherEllipsoidIsRefused) {
  install();
  const std::string bessel = "+proj=longlat +ellps=bessel +towgs84=598,73,418 +geoidgrids=own.tif";
  EXPECT_EQ(problem_type(dem_, with_crs(bessel)), "");
  EXPECT_EQ(problem_type(dem_, with_crs(bessel + " +geoid_crs=horizontal_crs")), "geoid-not-found");
}

/// A GeoTIFF keeps the heights, and no grid's name.
TEST_F(NamedGrid, MayBeSaidOfAGeotiffThatLostIt) {
  install();
  Spec spec;
  spec.columns = spec.rows = 80, spec.crs = degrees("own.tif");
  const std::string lost = write(spec, "lost.tif");
  const auto bare = must_open(lost, {});
  ASSERT_TRUE(bare);
  EXPECT_EQ(bare->description().vertical_datum(), "EGM96");
  EXPECT_EQ(bare->description().vertical_datum_declared(), "a vertical datum without a name");
  const auto source = must_open(lost, with_crs(degrees("own.tif")));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "own.tif");
  expect_height(*source, 100);
}

}  // namespace
}  // namespace cordillera::raster_test
