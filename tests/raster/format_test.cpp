// Which files are raster files, and what a posted one may reach.
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

using raster::Trust;
using Format = RasterTest;

std::string hgt_bytes() {
  std::string bytes;
  for (int r = 0; r < 1201; ++r)
    for (int c = 0; c < 1201; ++c) bytes += {static_cast<char>((c + r) >> 8), static_cast<char>((c + r) & 255)};
  return bytes;
}

TEST_F(Format, AnHgtKnowsItsPlaceByNameOnly) {
  const std::string body = write_text(hgt_bytes(), "upload.part");
  for (const Trust trust : {Trust::operator_file, Trust::posted_file}) {
    const auto source = must_open(body, plain_options(), trust, "N44W072.hgt");
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().driver(), "SRTMHGT");
    EXPECT_EQ(source->description().file(), "N44W072.hgt");
    EXPECT_DOUBLE_EQ(source->description().bbox(0), -72);
    EXPECT_DOUBLE_EQ(source->description().bbox(1), 44);
    // 44.5 N, 71.5 W is the middle point.
    const proto::Lattice l = lattice(10);
    const auto w = source->window(l);
    const double c = (l.longitude_deg(w.west + 700) + 72) * 1200, r = (45 - l.latitude_deg(w.south + 700)) * 1200;
    EXPECT_NEAR(height_m(*source, l, w.west + 700, w.south + 700), c + r, 0.01);
  }
  EXPECT_EQ(problem_type(body, plain_options(), Trust::posted_file, "mountain.hgt"), "hgt-name");
  EXPECT_NE(problem_type(body, plain_options(), Trust::posted_file, "mountain.tif"), "");
  EXPECT_EQ(problem_type(write_text(hgt_bytes().substr(0, 100000), "short"), plain_options(), Trust::posted_file, "N44W072.hgt"),
            "hgt-name");
}

TEST_F(Format, AnHgtBeyondThePoleIsToldSo) {
  const auto opened = open(write_text(hgt_bytes(), "N90E000.hgt"));
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.problem().type, "crs-not-transformable");
  EXPECT_EQ(opened.problem().detail, "N90E000.hgt lies beyond the pole: its middle is at latitude 90.500000");
}

TEST_F(Format, EsriAscii) {
  const std::string file =
      write_text("ncols 3\nnrows 2\nxllcorner 10\nyllcorner 45\ncellsize 0.5\nNODATA_value -9999\n1 2 3\n4 -9999 6\n", "a.asc");
  EXPECT_EQ(problem_type(file), "raster-without-crs");
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:4326");
  const auto source = must_open(file, options, Trust::posted_file, "a.asc");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().driver(), "AAIGrid");
  const proto::Lattice l = lattice(6);
  EXPECT_TRUE(std::isnan(height_m(*source, l, std::llround((190.75) / l.cell_deg()), std::llround(135.25 / l.cell_deg()))));
  EXPECT_NEAR(height_m(*source, l, std::llround(190.05 / l.cell_deg()), std::llround(135.95 / l.cell_deg())), 1, 0.2);
}

/// GDAL's driver of Esri's raw files opens any file that has a .hdr beside it, and would read numbers out of whatever it is.
TEST_F(Format, AHeaderBesideAFileOfAnotherKindIsNotItsOwn) {
  Spec raw;
  raw.driver = "EHdr";
  const std::string bil = write(raw, "dem.bil");
  EXPECT_EQ(problem_type(bil), "");
  for (const char* name : {"dem.pix", "dem.grb", "dem"}) {
    std::filesystem::copy_file(bil, path(name));
    EXPECT_EQ(problem_type(path(name)), "raster-format-unsupported") << name;
  }
  std::filesystem::copy_file(bil, path("dem.DEM"));  // GTOPO30
  EXPECT_EQ(problem_type(path("dem.DEM")), "");
}

// The line that a refusal gives makes a grid of them.
TEST_F(Format, PointsInAnyOrderAreToldHowToBeSorted) {
  const std::string points = write_text("500030 5300000 4\n500000 5300030 1\n500030 5300030 2\n500000 5300000 3\n", "points.xyz");
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:32632");
  const auto refused = open(points, options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "raster-format-unsupported");
  const std::size_t line = refused.problem().accepted.find("sort ");
  ASSERT_NE(line, std::string::npos) << refused.problem().line();
  ASSERT_EQ(std::system(("cd '" + std::filesystem::path(points).parent_path().string() + "' && " +
                         refused.problem().accepted.substr(line))
                            .c_str()),
            0);
  const std::string sorted = path("sorted.xyz");
  EXPECT_TRUE(open(sorted, options).ok());
}

TEST_F(Format, ACrsBesideItIsItsOwn) {
  const char* const prj = R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],)"
                          R"(PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  Spec spec;
  spec.crs = "";
  const std::string tiff = write(spec, "bare.tif"),
                    points = write_text("10 45 1\n10.1 45 2\n10 44.9 3\n10.1 44.9 4\n", "points.xyz");
  for (const std::string& file : {tiff, points}) {
    EXPECT_EQ(problem_type(file), "raster-without-crs") << file;
    const std::string beside = write_text(prj, std::filesystem::path(file).stem().string() + ".prj");
    std::filesystem::last_write_time(
        file, std::filesystem::last_write_time(file) + std::chrono::seconds(2));  // no earlier copy of the points
    EXPECT_EQ(problem_type(file), "") << file;
    EXPECT_EQ(problem_type(file, plain_options(), Trust::posted_file, "dem" + std::filesystem::path(file).extension().string()),
              "raster-without-crs")
        << file;
  }
}

TEST_F(Format, APostedFileReachesNoOther) {
  Spec spec;
  spec.crs = "";
  const std::string file = write(spec, "bare.tif");
  // Sidecars beside it: a CRS by PAM, a world file, an external mask.
  write_text("<PAMDataset><SRS>EPSG:4326</SRS></PAMDataset>", "bare.tif.aux.xml");
  EXPECT_EQ(problem_type(file, plain_options(), Trust::operator_file), "");
  EXPECT_EQ(problem_type(file, plain_options(), Trust::posted_file), "raster-without-crs");
  EXPECT_EQ(problem_type(file, plain_options(), Trust::posted_file, "bare.tif"), "raster-without-crs");
  const std::string vrt = write_text(
      "<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"><SRS>EPSG:4326</SRS><GeoTransform>10,0.01,0,45,0,-0.01</GeoTransform>"
      "<VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">bare.tif</SourceFilename>"
      "<SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>",
      "a.vrt");
  EXPECT_EQ(problem_type(vrt, plain_options(), Trust::posted_file), "raster-format-unsupported");
  EXPECT_EQ(problem_type(vrt, plain_options(), Trust::operator_file), "");
  EXPECT_EQ(problem_type("/vsimem/none.tif", plain_options(), Trust::posted_file), "raster-not-found");
  EXPECT_EQ(problem_type(path("none.tif")), "raster-not-found");
}

TEST_F(Format, NamesCannotEscape) {
  const std::string file = write({}, "dem.tif");
  for (const char* name : {"../../etc/passwd", "a b;c.tif", "..", ".tif", "", "\xc3\xa9t\xc3\xa9.tif"})
    EXPECT_EQ(problem_type(file, plain_options(), Trust::posted_file, name), "") << name;
}

TEST_F(Format, CloudOptimised) {
  Spec spec;
  spec.columns = spec.rows = 700, spec.driver = "COG", spec.create = {"COMPRESS=DEFLATE"};
  spec.geotransform = {10, 0.001, 0, 45, 0, -0.001};
  const auto source = must_open(write(spec), plain_options(), Trust::posted_file);
  ASSERT_TRUE(source);
  EXPECT_EQ(valid_share(whole(*source, lattice(8))), 1.0);
}

TEST_F(Format, NothingIsLeftInTheTemporaryFolder) {
  const std::string file = write({}), temporary = path("temporary");
  std::filesystem::create_directory(temporary);
  const char* usual = std::getenv("TMPDIR");
  const std::string before = usual != nullptr ? usual : "";
  setenv("TMPDIR", temporary.c_str(), 1);  // the usual one is everybody's
  const auto unused = std::filesystem::last_write_time(temporary) - std::chrono::hours(1);
  std::filesystem::last_write_time(temporary, unused);
  const auto source = must_open(file, plain_options(), Trust::posted_file);
  EXPECT_NE(std::filesystem::last_write_time(temporary), unused) << "it was made elsewhere: the test tests nothing";
  EXPECT_TRUE(std::filesystem::is_empty(temporary));
  usual != nullptr ? setenv("TMPDIR", before.c_str(), 1) : unsetenv("TMPDIR");
}

}  // namespace
}  // namespace cordillera::raster_test
