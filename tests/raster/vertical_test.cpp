// Which surface heights count from, and the way to the ellipsoid.
#include <ogr_spatialref.h>
#include <unistd.h>

#include <GeographicLib/Geoid.hpp>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>

#include "geoid_fixture.h"
#include "raster/datum/geoid.h"
#include "raster/place/crs.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;

class Vertical : public WithGeoid {
 protected:
  /// Where the build has put it, as GeographicLib wants to be told.
  static std::string egm96_folder() { return fs::path(raster::egm96_path()).parent_path(); }
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

}  // namespace
}  // namespace cordillera::raster_test
