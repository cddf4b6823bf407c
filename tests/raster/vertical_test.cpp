// Which surface heights count from, and the way to the ellipsoid.
#include <ogr_spatialref.h>
#include <unistd.h>

#include <GeographicLib/Geoid.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/datum/geoid.h"
#include "raster/place/crs.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;

class Vertical : public RasterTest {
 protected:
  /// Where the build has put it, as GeographicLib wants to be told.
  static std::string egm96_folder() { return fs::path(raster::egm96_path()).parent_path(); }
  /// Regional geoid grid: 3 x 3 points from 9 E, 44 N at half a degree, height 40 + lon + 2 lat.
  std::string write_geoid(const std::string& name, double west = 9) const {
    Spec grid;
    grid.columns = grid.rows = 5, grid.geotransform = {west - 0.25, 0.5, 0, 46.25, 0, -0.5};
    grid.value = [west](int c, int r) { return -60 + (west + 0.5 * c) + 2 * (46 - 0.5 * r); };
    return write(grid, name);
  }
};

TEST_F(Vertical, Egm96IsTheDocumentedDefault) {
  const auto source = must_open(write({}), {});
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "EGM96");
  EXPECT_EQ(source->description().vertical_datum_from(), "default");
  ASSERT_NE(raster::egm96_path(), "");
  const GeographicLib::Geoid geoid("egm96-15", egm96_folder());
  const proto::Lattice l = lattice(7);
  const auto w = source->window(l);
  EXPECT_NEAR(height_m(*source, l, w.west, w.south), 100 + geoid(l.latitude_deg(w.south), l.longitude_deg(w.west)), 0.001);
  // Published: the undulation of EGM96 at 16:46:33 N 3:00:34 W is 28.7 m within a decimetre.
  EXPECT_NEAR(geoid(16 + 46 / 60.0 + 33 / 3600.0, -(3 + 34 / 3600.0)), 28.7, 0.1);
}

/// Whole parallels are interpolated at once; each of their heights must still be its own vertex's.
TEST_F(Vertical, UndulationsAlongAParallelAreThoseOfItsPoints) {
  Spec spec;
  spec.columns = spec.rows = 12;
  for (const double west : {9.9, -0.13, 179.85}) {  // over corners of the grid's cells, Greenwich, the antimeridian
    spec.geotransform = {west, 0.05, 0, 45.1, 0, -0.05};
    const auto source = must_open(write(spec), {});
    ASSERT_TRUE(source);
    const proto::Lattice l = lattice(10);
    const proto::Samples all = whole(*source, l);
    const GeographicLib::Geoid geoid("egm96-15", egm96_folder());
    int different = 0;
    std::size_t at = 0;
    for (std::int64_t j = all.south; j < all.south + all.rows; ++j) {
      for (std::int64_t i = all.west; i < all.west + all.columns; ++i, ++at) {
        const double undulation = std::nearbyint(geoid(l.latitude_deg(j), l.longitude_deg(i % l.columns())) * 65536) / 65536;
        different += all.height[at] != std::nearbyint((100 + undulation) * 1024);
      }
    }
    EXPECT_GT(at, 500000u);
    EXPECT_EQ(different, 0) << west;
  }
}

TEST_F(Vertical, TheRewrittenGridEqualsTheRealOne) {
  const std::string real = real_dems();
  if (real.empty() || !fs::exists(real + "/geoid/egm96-15.pgm")) GTEST_SKIP() << "no real geoid grid: set CORDILLERA_TEST_DATA";
  const GeographicLib::Geoid theirs("egm96-15", real + "/geoid");
  const GeographicLib::Geoid ours("egm96-15", egm96_folder());
  // Two roundings of one grid to steps of 3 mm: equal at all but a few points in ten thousand, there by one step.
  int points = 0, different = 0;
  for (double lat = -90; lat <= 90; lat += 0.75) {
    for (double lon = -180; lon < 180; lon += 0.75) {
      const double difference = std::abs(ours(lat, lon) - theirs(lat, lon));
      ASSERT_LT(difference, 0.003) << lat << ", " << lon;
      ++points;
      different += difference > 1e-6;
    }
  }
  EXPECT_LT(different, points / 200);
}

TEST_F(Vertical, DeclaredBySource) {
  const struct {
    const char* crs;
    const char* datum;
    const char* from;
  } cases[] = {
      {"EPSG:4326+5773", "EGM96", "source"}, {"EPSG:32632+5773", "EGM96", "source"}, {"EPSG:4979", "ellipsoid", "source"}};
  for (const auto& k : cases) {
    Spec spec;
    spec.crs = k.crs;
    if (std::string(k.crs).find("32632") != std::string::npos) spec.geotransform = {500000, 100, 0, 5000000, 0, -100};
    const auto source = must_open(write(spec), {});
    ASSERT_TRUE(source) << k.crs;
    EXPECT_EQ(source->description().vertical_datum(), k.datum) << k.crs;
    EXPECT_EQ(source->description().vertical_datum_from(), k.from) << k.crs;
    const proto::Lattice l = lattice(12);
    const auto w = source->window(l);
    const double height = height_m(*source, l, (w.west + w.east) / 2, (w.south + w.north) / 2);
    // Shifted once, not twice: the geoid is 30 to 55 m above the ellipsoid here.
    const bool ellipsoidal = std::string(k.datum) == "ellipsoid";
    EXPECT_TRUE(ellipsoidal ? height == 100 : height > 130 && height < 155) << height;
  }
}

TEST_F(Vertical, ARegionalGridIsReadAndMustCover) {
  proto::BuildOptions options;
  options.set_vertical_datum(write_geoid("regional.tif"));
  Spec spec;
  spec.columns = spec.rows = 80;
  const std::string dem = write(spec);
  const auto source = must_open(dem, options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "regional.tif");
  const proto::Lattice l = lattice(7);
  const auto w = source->window(l);
  const double lon = l.longitude_deg(w.west + 3), lat = l.latitude_deg(w.south + 5);
  EXPECT_NEAR(height_m(*source, l, w.west + 3, w.south + 5), 100 - 60 + lon + 2 * lat, 0.01);
  options.set_vertical_datum(write_geoid("elsewhere.tif", 10.3));
  EXPECT_EQ(problem_type(dem, options), "geoid-does-not-cover");
}

TEST_F(Vertical, AskedForAsDepthsCountsDownwards) {
  for (const auto& [name, sign] : {std::pair{"EPSG:5714", 1}, {"EPSG:5715", -1}}) {
    proto::BuildOptions options;
    options.set_vertical_datum(name);
    const auto source = must_open(write({}), options);
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().scale(), sign) << name;
  }
}

/// A CRS of three axes, whose third is in feet.
TEST_F(Vertical, HeightsAboveTheEllipsoidMayBeInFeet) {
  const std::string axis = R"(,AXIS["ellipsoidal height",up,ORDER[3],LENGTHUNIT["foot",0.3048]])";
  const std::string crs = R"(GEOGCRS["WGS 84",DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563]],)"
                          R"(CS[ellipsoidal,3],AXIS["latitude",north,ORDER[1],ANGLEUNIT["degree",0.0174532925199433]],)"
                          R"(AXIS["longitude",east,ORDER[2],ANGLEUNIT["degree",0.0174532925199433]])" +
                          axis + "]";
  Spec bare;
  bare.crs = "";
  proto::BuildOptions options;
  options.set_crs(crs);
  const auto source = must_open(write(bare), options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().vertical_datum(), "ellipsoid");
  EXPECT_NEAR(source->description().scale(), 0.3048, 1e-12);
}

TEST_F(Vertical, TheEllipsoidHasMoreThanOneName) {
  for (const char* name : {"ellipsoid", "ellipsoidal", "WGS84", "wgs 84", "EPSG:4979"}) {
    SCOPED_TRACE(name);
    proto::BuildOptions options;
    options.set_vertical_datum(name);
    const auto source = must_open(write({}), options, raster::Trust::posted_file, "dem.tif");
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().vertical_datum(), "ellipsoid");
    EXPECT_EQ(source->description().vertical_datum_from(), "request");
  }
}

TEST_F(Vertical, PostedFilesNameOnlyGridsOfTheOperator) {
  const std::string grid = write_geoid("regional.tif"), dem = write({});
  proto::BuildOptions options;
  options.set_vertical_datum(grid);
  EXPECT_EQ(problem_type(dem, options, raster::Trust::posted_file), "geoid-not-found");
  options.set_vertical_datum("regional.tif");
  EXPECT_EQ(problem_type(dem, options, raster::Trust::posted_file), "geoid-not-found");
  EXPECT_THAT(open(dem, options).problem().detail, ::testing::HasSubstr("looked for in the folders of CORDILLERA_GEOIDS"));
  setenv("CORDILLERA_GEOIDS", fs::path(grid).parent_path().c_str(), 1);
  EXPECT_EQ(problem_type(dem, options, raster::Trust::posted_file), "");
  unsetenv("CORDILLERA_GEOIDS");
}

TEST_F(Vertical, ANameThatIsKnownInPartIsAnsweredWithWhatItMayMean) {
  const auto said = [&](const char* name) {
    proto::BuildOptions options;
    options.set_vertical_datum(name);
    return open(write({}), options, raster::Trust::posted_file, "dem.tif").problem().detail;
  };
  EXPECT_THAT(said("IGN69"), ::testing::EndsWith("; is it one of these: NGF-IGN69 height"));
  EXPECT_THAT(said("CGVD2013"), ::testing::HasSubstr("CGVD2013(CGG2013) height"));
  EXPECT_THAT(said("nonsense"), ::testing::EndsWith("a grid file that may be read"));
  EXPECT_THAT(said("m"), ::testing::EndsWith("a grid file that may be read")) << "too little to go by";
}

/// Of rasters that are opened one after the other each would read all of it again.
TEST_F(Vertical, ASmallGridIsReadOnce) {
  const std::string head = "P5\n# Origin 90N 0E\n# Offset -100\n# Scale 1\n8 5\n65535\n";
  const auto points = [](char low) {
    std::string bytes;
    for (int k = 0; k < 8 * 5; ++k) bytes += std::string(1, '\0') + low;
    return bytes;
  };
  auto options = plain_options();
  options.set_vertical_datum(write_text(head + points(120), "small.pgm"));
  const std::string file = options.vertical_datum(), raster = write(Spec());
  const auto height = [&] {
    const auto source = must_open(raster, options);
    const auto w = source->window(lattice(9));
    return height_m(*source, lattice(9), w.west + 1, w.south + 1);
  };
  EXPECT_EQ(height(), 120);
  const auto time = fs::last_write_time(file);
  write_text(head + points(70), "small.pgm");
  fs::last_write_time(file, time);  // as if it had not changed
  EXPECT_EQ(height(), 120);
  fs::last_write_time(file, time + std::chrono::seconds(1));
  EXPECT_EQ(height(), 70);
}

TEST_F(Vertical, MissingAndWrongGrids) {
  proto::BuildOptions options;
  const std::string dem = write({});
  for (const char* missing : {"EGM2008", "EGM84", "no-such-grid.gtx", "nonsense"}) {
    options.set_vertical_datum(missing);
    setenv("CORDILLERA_GEOIDS", path("none").c_str(), 1);
    auto refused = open(dem, options);
    if (refused.ok()) continue;  // this machine has the grid
    EXPECT_EQ(refused.problem().type, "geoid-not-found");
    EXPECT_EQ(refused.problem().parameter, "vertical_datum");
    EXPECT_THAT(open(dem, options, raster::Trust::posted_file, "dem.tif").problem().line(),
                ::testing::Not(::testing::HasSubstr(path("none"))));
  }
  setenv("CORDILLERA_GEOIDS", path("").c_str(), 1);
  write_text("P5\n# Origin 90N 0E\n# Offset 0\n# Scale 1\n4 3\n65535\n01", "cut.pgm");
  options.set_vertical_datum("cut.pgm");
  const auto cut = open(dem, options, raster::Trust::posted_file, "dem.tif");
  ASSERT_FALSE(cut.ok());
  EXPECT_EQ(cut.problem().type, "geoid-invalid");
  EXPECT_THAT(cut.problem().line(), ::testing::Not(::testing::HasSubstr(path(""))));
  unsetenv("CORDILLERA_GEOIDS");
  options.set_vertical_datum(write_text("P5\n# Origin 44N 9E\n4 4\n65535\n0123456789012345678901234567890", "regional.pgm"));
  EXPECT_EQ(problem_type(dem, options), "geoid-invalid");
  options.set_vertical_datum(write_text("no grid", "grid.gtx"));
  EXPECT_EQ(problem_type(dem, options), "geoid-invalid");
}

/// +geoidgrids= of a PROJ string, PROJ4_GRIDS of WKT: a grid that the CRS itself names.
class NamedGrid : public Vertical {
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
