// What a refusal says is the cause, and the line that it prints works.
#include <gdal_priv.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "fixture.h"

namespace cordillera {
namespace {

using raster_test::must_open;
using raster_test::open;
using raster_test::plain_options;
using raster_test::Spec;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class ToldCause : public raster_test::RasterTest {
 protected:
  static std::string told(const std::string& file, const proto::BuildOptions& options = plain_options()) {
    const auto refused = open(file, options);
    return refused.ok() ? "opens" : refused.problem().line();
  }
};

TEST_F(ToldCause, RationalPolynomialsNeedAWarp) {
  Spec spec;
  spec.georeferenced = false;
  const std::string file = write(spec);
  {
    const GDALDatasetUniquePtr raster(GDALDataset::Open(file.c_str(), GDAL_OF_UPDATE));
    CPLStringList rpc;
    for (const char* key : {"LINE_OFF", "SAMP_OFF", "LAT_OFF", "LONG_OFF", "HEIGHT_OFF", "LINE_SCALE", "SAMP_SCALE", "LAT_SCALE",
                            "LONG_SCALE", "HEIGHT_SCALE"})
      rpc.SetNameValue(key, "1");
    for (const char* key : {"LINE_NUM_COEFF", "LINE_DEN_COEFF", "SAMP_NUM_COEFF", "SAMP_DEN_COEFF"})
      rpc.SetNameValue(key, "1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0");
    raster->SetMetadata(rpc.List(), "RPC");
  }
  EXPECT_THAT(told(file), AllOf(HasSubstr("dem.tif is placed by RPCs only"),
                                HasSubstr("gdalwarp -rpc -t_srs EPSG:CODE dem.tif dem-2.tif"), Not(HasSubstr("a_ullr"))));
}

/// y goes from 8 to 11.75, so that as text 9.75 comes after 10; x from -4 on.
std::string mixed_points(const std::string& names, const std::string& separator, bool y_first) {
  std::vector<std::string> lines;
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 10; ++column) {
      char x[20], y[20];
      std::snprintf(x, sizeof x, "%g", -4 + 0.25 * column);
      std::snprintf(y, sizeof y, "%g", 8 + 0.25 * row);
      lines.push_back((y_first ? y + separator + x : x + separator + y) + separator + std::to_string(100 + 10 * column + row));
    }
  }
  std::uint32_t seed = 7;
  for (std::size_t k = lines.size() - 1; k > 0; --k) std::swap(lines[k], lines[(seed = seed * 1664525 + 1013904223) % (k + 1)]);
  std::string text = names.empty() ? "" : names + "\n";
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

TEST_F(ToldCause, ThePrintedLineSortsPointsAsItStands) {
  struct Kind {
    const char *names, *separator, *file;
    bool y_first = false;
  };
  const Kind kinds[] = {{"", " ", "points.xyz"},           {"", "\t", "a b's.xyz"},      {"", ",", "sorted.xyz"},
                        {"", ";", "points.csv"},           {"x y z", " ", "points.xyz"}, {"lon,lat,height", ",", "sorted.xyz"},
                        {"Y;X;Z", ";", "points.txt", true}};
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(std::string(kind.names) + kind.separator + kind.file);
    const std::string points = mixed_points(kind.names, kind.separator, kind.y_first);
    const std::string file = write_text(points, kind.file);
    auto options = plain_options();
    options.set_crs("EPSG:4326");
    const std::string refusal = told(file, options);
    ASSERT_THAT(refusal, HasSubstr("is points in an order that makes no grid"));
    const std::string line = refusal.substr(refusal.find("to east: ") + 9);
    ASSERT_EQ(std::system(("cd '" + path("") + "' && " + line).c_str()), 0) << line;
    std::ostringstream now;
    now << std::ifstream(file).rdbuf();
    EXPECT_EQ(now.str(), points) << "the user's file stays";
    const std::string sorted = path(line.substr(line.rfind("> ") + 2));
    const auto source = raster_test::must_open(sorted, options);
    ASSERT_TRUE(source) << line;
    EXPECT_EQ(source->description().columns(), 10);
    EXPECT_EQ(source->description().rows(), 16);
    const double longitude = -3.5, latitude = 10.25;
    double height_m = 0;
    ASSERT_TRUE(source->nearest({&longitude, 1}, {&latitude, 1}, &height_m).ok());
    EXPECT_EQ(height_m, 100 + 10 * 2 + 9);
  }
}

TEST_F(ToldCause, AHeaderOfEnviIsNotEsris) {
  Spec spec;
  const GDALDatasetUniquePtr raster(GDALDataset::Open(write(spec).c_str(), GDAL_OF_RASTER));
  const std::string file = path("dem.bil");
  GDALDriver* const envi = GetGDALDriverManager()->GetDriverByName("ENVI");
  if (envi == nullptr) GTEST_SKIP() << "this GDAL writes no ENVI";
  GDALDatasetUniquePtr(envi->CreateCopy(file.c_str(), raster.get(), FALSE, nullptr, nullptr, nullptr));
  EXPECT_THAT(told(file), AllOf(HasSubstr("dem.bil has a header of ENVI beside it, and only Esri's are read"),
                                HasSubstr("gdal_translate dem.bil dem.tif")));
}

TEST_F(ToldCause, AFolderThatIsNotThereHasAName) {
  EXPECT_EQ(told(path("nofile/")), "nofile does not exist");
  EXPECT_THAT(told("/"), StartsWith("\"/\" is not a file"));
}

TEST_F(ToldCause, AVerticalUnitOfAnyNameHasTheLengthThatItsSystemStates) {
  Spec spec;
  spec.crs = "EPSG:4326+5754";  // British foot (1936)
  const auto feet = raster_test::must_open(write(spec));
  ASSERT_TRUE(feet);
  EXPECT_EQ(feet->description().unit(), "British foot (1936)");
  const double longitude = 10.04, latitude = 44.96;
  double height_m = 0;
  ASSERT_TRUE(feet->nearest({&longitude, 1}, {&latitude, 1}, &height_m).ok());
  EXPECT_NEAR(height_m, 30.48007491, 1e-9);
  spec.unit = "perch";  // a band says no length
  EXPECT_THAT(told(write(spec, "perch.tif")), HasSubstr("\"perch\", a unit not known here"));
}

TEST_F(ToldCause, AGeocentricSystemIsNoCureForAnother) {
  auto options = plain_options();
  options.set_crs("EPSG:4978");
  EXPECT_THAT(told(write({}), options), AllOf(HasSubstr("crs=EPSG:4978 is geocentric"), Not(HasSubstr("gdal_translate"))));
}

/// Where they would be copied to there is no room for them.
TEST_F(ToldCause, PointsWithoutACrsAreRefusedBeforeTheyAreCopied) {
  const std::string file = write_text("0 1 5\n1 1 5\n0 0 5\n1 0 5\n", "points.xyz");
  const char* const before = std::getenv("TMPDIR");
  const std::string kept = before == nullptr ? "" : before;
  setenv("TMPDIR", path("none").c_str(), 1);
  auto options = plain_options();
  const std::string bare = told(file, options);
  options.set_crs("EPSG:4326");
  const std::string placed = told(file, options);
  before == nullptr ? unsetenv("TMPDIR") : setenv("TMPDIR", kept.c_str(), 1);
  EXPECT_THAT(bare, HasSubstr("names no coordinate reference system"));
  EXPECT_THAT(placed, HasSubstr("no temporary folder")) << "this asks nothing then";
}

/// A VRT may make its pixels by a function: where GDAL does not run it, nothing is damaged.
TEST_F(ToldCause, APixelFunctionThatIsNotRun) {
  write(Spec());
  const auto vrt = [&](const std::string& function) {
    const std::string band = R"(<VRTRasterBand dataType="Float32" band="1" subClass="VRTDerivedRasterBand">)" + function +
                             R"(<SimpleSource><SourceFilename relativeToVRT="1">dem.tif</SourceFilename></SimpleSource>)";
    const std::string file = write_text(R"(<VRTDataset rasterXSize="8" rasterYSize="8"><SRS>EPSG:4326</SRS>)"
                                        R"(<GeoTransform>10, 0.01, 0, 45, 0, -0.01</GeoTransform>)" +
                                            band + "</VRTRasterBand></VRTDataset>",
                                        "made.vrt");
    const auto source = must_open(file);
    const auto window = source->window(raster_test::lattice(9));
    const auto samples = source->sample(raster_test::lattice(9), window.west, window.south, 4, 4);
    return samples.ok() ? "reads" : samples.problem().line();
  };
  EXPECT_THAT(vrt("<PixelFunctionType>f</PixelFunctionType><PixelFunctionLanguage>Python</PixelFunctionLanguage>"
                  "<PixelFunctionCode>def f(a, out, *rest, **words): out[:] = a[0]</PixelFunctionCode>"),
              AllOf(StartsWith("made.vrt makes its pixels by a function in Python"),
                    HasSubstr("GDAL_VRT_ENABLE_PYTHON=YES gdal_translate made.vrt made.tif"), Not(HasSubstr("damaged"))));
  EXPECT_THAT(vrt("<PixelFunctionType>nosuch</PixelFunctionType>"),
              AllOf(HasSubstr("a function, which GDAL could not run"), HasSubstr("nosuch"), Not(HasSubstr("damaged"))));
  EXPECT_THAT(vrt("<PixelFunctionType>sum</PixelFunctionType>"),  // of one source
              AllOf(HasSubstr("a function, which GDAL could not run;"), Not(HasSubstr("damaged"))));
}

}  // namespace
}  // namespace cordillera
