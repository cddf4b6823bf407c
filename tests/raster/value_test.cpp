// From raw values to metres: types, scale, offset, units, and everything that is no height.
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include <gdal_priv.h>
#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/pixels/decimation.h"

namespace cordillera::raster_test {
namespace {

using Value = RasterTest;

constexpr int kLevel = 8;

Spec aligned(const std::string& type) {
  Spec spec;
  spec.type = type;
  spec.geotransform = cells_of(kLevel, 70000, 50000);
  return spec;
}

/// Height inside the area of pixel (c, r): at its centre, two levels finer would do; one finer is its centre exactly.
double pixel_m(raster::Source& source, int c, int r) {
  return height_m(source, lattice(kLevel + 1), 2 * (70000 + c) + 1, 2 * (50000 - r) - 1);
}

TEST_F(Value, EveryTypeIsRead) {
  for (const char* type : {"Byte", "UInt16", "Int16", "UInt32", "Int32", "Int64", "UInt64", "Float32", "Float64"}) {
    Spec spec = aligned(type);
    spec.value = [](int c, int r) { return 10 * r + c; };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source) << type;
    EXPECT_EQ(source->description().data_type(), type);
    EXPECT_EQ(pixel_m(*source, 3, 5), 53) << type;
  }
  Spec bytes = aligned("Byte");
  bytes.create = {"PIXELTYPE=SIGNEDBYTE"};
  bytes.value = [](int, int) {
    return GDAL_VERSION_NUM < GDAL_COMPUTE_VERSION(3, 7, 0) ? 251 : -5;
  };  // later it is a type of its own
  EXPECT_EQ(pixel_m(*must_open(write(bytes)), 2, 2), -5);
  EXPECT_EQ(problem_type(write(aligned("CFloat32"))), "raster-type");
}

TEST_F(Value, InATextGridOfWholeNumbersNanAndInfinityAreNoHeights) {
  const auto grid = [](const std::string& word) {
    std::string text = "ncols 4\nnrows 4\nxllcorner 10\nyllcorner 45\ncellsize 0.01\nnodata_value nan\n";
    for (int k = 0; k < 16; ++k) text += (k == 5 ? word : std::to_string(100 + k)) + (k % 4 == 3 ? "\n" : " ");
    return text;
  };
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:4326");
  for (const char* word : {"nan", "-inf", "NaN", "Infinity", "1.#QNAN"}) {
    const auto source = open(write_text(grid(word), std::string("grid") + word + ".asc"), options);
    ASSERT_TRUE(source.ok()) << word << source.problem().line();
    const double at[] = {10.015, 10.025}, north[] = {45.025, 45.025};
    double height_m[2] = {};
    ASSERT_TRUE((*source)->nearest(at, north, height_m).ok());
    EXPECT_TRUE(std::isnan(height_m[0])) << word << " is read as " << height_m[0];
    EXPECT_EQ(height_m[1], 106) << word;
  }
  for (const char* word : {"abc", "12m", "n/a", "#N/A"}) {
    const auto refused = open(write_text(grid(word), "words.asc"), options);
    ASSERT_FALSE(refused.ok()) << word;
    EXPECT_EQ(refused.problem().type, "raster-unreadable");
    EXPECT_THAT(refused.problem().detail, testing::HasSubstr("\"" + std::string(word) + "\" in line 8"));
  }
}

TEST_F(Value, AColourTableIsNoHeights) {
  const std::string file = write(aligned("Byte"));
  ASSERT_EQ(problem_type(file), "");
  {
    const GDALDatasetUniquePtr picture(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    GDALColorTable colours;
    const GDALColorEntry green{0, 128, 0, 255};
    colours.SetColorEntry(100, &green);
    ASSERT_EQ(picture->GetRasterBand(1)->SetColorTable(&colours), CE_None);
  }
  EXPECT_EQ(problem_type(file), "raster-type");
}

TEST_F(Value, ScaleOffsetAndUnit) {
  const struct {
    const char* unit;
    double metres;
  } units[] = {{"", 1},
               {"m", 1},
               {"Metre", 1},
               {"meters", 1},
               {"ft", 0.3048},
               {"Foot", 0.3048},
               {"feet", 0.3048},
               {"US survey foot", 1200.0 / 3937},
               {"US_survey_foot", 1200.0 / 3937},
               {"ftUS", 1200.0 / 3937},
               {"Foot_US", 1200.0 / 3937},
               {"km", 1000},
               {"kilometre", 1000},
               {"cm", 0.01}};
  for (const auto& unit : units) {
    Spec spec = aligned("Int16");
    spec.unit = unit.unit, spec.scale = 0.5, spec.offset = -3;
    spec.value = [](int, int) { return 20; };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source) << unit.unit;
    EXPECT_NEAR(pixel_m(*source, 1, 1), 7 * unit.metres, 0.0005) << unit.unit;
    EXPECT_DOUBLE_EQ(source->description().scale(), 0.5 * unit.metres);
    EXPECT_DOUBLE_EQ(source->description().offset(), -3 * unit.metres);
  }
  Spec odd = aligned("Int16");
  odd.unit = "furlong";
  const std::string file = write(odd);
  EXPECT_EQ(problem_type(file), "unit-unknown");
  proto::BuildOptions options = plain_options();
  options.set_z_scale(2);
  options.set_z_offset(5);
  EXPECT_EQ(pixel_m(*must_open(file, options), 1, 1), 205);
}

TEST_F(Value, AFactorBeforeAUnitIsApplied) {
  const std::pair<const char*, double> units[] = {{"0.1 m", 0.1},      {"1e-3 m", 0.001}, {"10 cm", 0.1},      {"[0.5 m]", 0.5},
                                                  {".01 metre", 0.01}, {"0.1m", 0.1},     {"100 feet", 30.48}, {"1 m", 1}};
  for (const auto& [unit, metres] : units) {
    Spec spec = aligned("Int16");
    spec.unit = unit;
    spec.value = [](int, int) { return 100; };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source) << unit;
    EXPECT_NEAR(pixel_m(*source, 1, 1), 100 * metres, 0.0005) << unit;
    EXPECT_DOUBLE_EQ(source->description().scale(), metres) << unit;
  }
}

TEST_F(Value, AUnitOfMoreThanANameIsNotThatName) {
  for (const char* unit : {"m/10", "m2", "m^2", "m*10", "m\xc2\xb2", "0 m", "-10 m", "1/10 m", "10", "10 10 m", "1e999 m",
                           "0.1 furlong", "-m", "Mm", "m m"}) {
    Spec spec = aligned("Int16");
    spec.unit = unit;
    EXPECT_EQ(problem_type(write(spec)), "unit-unknown") << unit;
  }
  for (const char* unit : {"m.", "(m)", "[m]", " m ", "us-ft", "ft (US)", "'metre'", "U.S. survey foot"}) {
    Spec spec = aligned("Int16");
    spec.unit = unit;
    EXPECT_EQ(problem_type(write(spec)), "") << unit;
  }
}

TEST_F(Value, UnitOfTheVerticalAxis) {
  Spec spec = aligned("Float32");
  spec.crs = "EPSG:4269+6360";  // NAVD88 height in US survey feet
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  EXPECT_NEAR(pixel_m(*source, 1, 1), 100 * 1200.0 / 3937, 0.0005);
}

TEST_F(Value, AnotherUnitOfTheBandIsTakenAndNoted) {
  Spec spec = aligned("Float32");
  spec.crs = "EPSG:4269+6360";
  const auto notes = [&](const char* unit) {
    spec.unit = unit;
    const auto source = must_open(write(spec));
    std::string all;
    if (!source) return all;
    for (const std::string& note : source->description().notes())
      if (note.find("The band says") != note.npos) all += note;
    return all;
  };
  EXPECT_EQ(notes("US survey foot"), "");
  EXPECT_EQ(notes(""), "");
  EXPECT_EQ(
      notes("metre"),
      "The band says that its heights are in metre, and the vertical CRS that they are in US survey foot: the band's unit is "
      "taken; if the CRS is right, z_scale=0.3048006096");
  const auto source = must_open(path("dem.tif"));
  ASSERT_TRUE(source);
  EXPECT_NEAR(pixel_m(*source, 1, 1), 100, 0.0005);
}

TEST_F(Value, DepthsAreHeightsBelowZero) {
  Spec spec = aligned("Float32");
  spec.value = [](int, int) { return -4321.5; };
  const auto sea = must_open(write(spec, "heights.tif"));
  ASSERT_TRUE(sea);
  EXPECT_NEAR(pixel_m(*sea, 1, 1), -4321.5, 0.0005);
  spec.crs = "EPSG:4326+5715";  // MSL depth: its axis points down
  spec.value = [](int, int) { return 4321.5; };
  const auto turned = must_open(write(spec, "depths.tif"));
  ASSERT_TRUE(turned);
  EXPECT_NEAR(pixel_m(*turned, 1, 1), -4321.5, 0.0005);
}

TEST_F(Value, NodataInAllItsForms) {
  const double inf = std::numeric_limits<double>::infinity(), nan = std::nan("");
  const struct {
    const char* type;
    std::optional<double> nodata;
    double raw;
  } cases[] = {{"Int16", -32768, -32768},
               {"UInt16", 0, 0},
               {"Float32", -9999, -9999},
               {"Float32", -3.4e38, -3.4e38},
               {"Float32", -3.40282e38, -3.4028234663852886e38},
               {"Float32", -9999.9, -9999.9},
               {"Float32", nan, nan},
               {"Float32", std::nullopt, nan},
               {"Float32", std::nullopt, inf},
               {"Float32", std::nullopt, -inf},
               {"Float32", std::nullopt, 3.4e38},
               {"Float64", std::nullopt, -1.7e308},
               {"Float32", -inf, -inf},
               {"Int32", std::nullopt, -2147483648.0},
               {"Int64", -99, -99},
               {"Float32", std::nullopt, 20000}};
  for (const auto& k : cases) {
    Spec spec = aligned(k.type);
    spec.nodata = k.nodata;
    spec.value = [&](int c, int r) { return c == 3 && r == 4 ? k.raw : 100.0; };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source) << k.type << k.raw;
    EXPECT_TRUE(std::isnan(pixel_m(*source, 3, 4))) << k.type << " " << k.raw;
    EXPECT_EQ(pixel_m(*source, 4, 4), 100) << k.type << " " << k.raw;  // a neighbour's void does not leak into the mean
  }
}

TEST_F(Value, MaskAndAlphaBands) {
  Spec masked = aligned("Float32");
  masked.mask = [](int c, int r) { return !(c == 3 && r == 4); };
  const auto source = must_open(write(masked));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().nodata(), "mask band");
  EXPECT_TRUE(std::isnan(pixel_m(*source, 3, 4)));
  EXPECT_EQ(pixel_m(*source, 2, 4), 100);
  Spec alpha = aligned("Byte");
  alpha.bands = 2, alpha.create = {"ALPHA=YES"};
  alpha.value = [](int c, int r) { return c == 3 && r == 4 ? 0.0 : 9.0; };
  const auto second = must_open(write(alpha));
  ASSERT_TRUE(second);
  EXPECT_TRUE(std::isnan(pixel_m(*second, 3, 4)));
}

TEST_F(Value, NodataValuesOfAllBandsAreAMask) {
  Spec spec = aligned("Int16");
  spec.columns = spec.rows = 64;
  spec.value = [](int c, int r) { return c < 32 && r < 32 ? -777.0 : 100.0; };
  const std::string file = write(spec);
  {
    const GDALDatasetUniquePtr dataset(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    ASSERT_EQ(dataset->SetMetadataItem("NODATA_VALUES", "-777"), CE_None);
    int half = 2;
    ASSERT_EQ(dataset->BuildOverviews("NEAREST", 1, &half, 0, nullptr, nullptr, nullptr), CE_None);
  }
  for (const auto trust : {raster::Trust::operator_file, raster::Trust::posted_file}) {
    const auto source = must_open(file, plain_options(), trust);
    ASSERT_TRUE(source);
    EXPECT_EQ(source->description().nodata(), "mask band");
    EXPECT_TRUE(std::isnan(pixel_m(*source, 3, 4)));
    EXPECT_EQ(pixel_m(*source, 40, 4), 100);
    const auto few = source->decimate(1000);  // of the overview, which does not say so, -777 would be a height
    ASSERT_TRUE(few.ok() && *few);
    EXPECT_EQ((*few)->mask.at(0), 0);
  }
}

TEST_F(Value, NodataOption) {
  Spec spec = aligned("Float32");
  spec.columns = spec.rows = 20, spec.nodata = -1;
  spec.value = [](int c, int r) {
    return c == 3 && r == 3 ? -8888.0 : c >= 5 && c <= 9 && r >= 5 && r <= 9 ? -1.0 : 2.0 * c + r;
  };
  const std::string file = write(spec);
  proto::BuildOptions options = plain_options();
  EXPECT_EQ(pixel_m(*must_open(file, options), 3, 3), -8888);
  options.set_nodata("-8888");
  EXPECT_TRUE(std::isnan(pixel_m(*must_open(file, options), 3, 3)));
  EXPECT_TRUE(std::isnan(pixel_m(*must_open(file, options), 7, 7))) << "beside the one that the file declares";
  for (const char* wrong : {"holes", "inf", "7m"}) {
    options.set_nodata(wrong);
    EXPECT_EQ(problem_type(file, options), "option-invalid") << wrong;
  }
}

TEST_F(Value, VoidsOption) {
  Spec spec = aligned("Float32");
  spec.columns = spec.rows = 20, spec.nodata = -1;
  spec.value = [](int c, int r) { return c >= 5 && c <= 9 && r >= 5 && r <= 9 ? -1.0 : 2.0 * c + r; };
  const std::string file = write(spec);
  proto::BuildOptions options = plain_options();
  options.set_voids("33.5");
  options.set_z_scale(2);  // bears on the source's values, not on the height put into voids
  EXPECT_EQ(pixel_m(*must_open(file, options), 7, 7), 33.5);
  EXPECT_EQ(pixel_m(*must_open(file, options), 1, 1), 6);
  for (const char* left : {"hole", "fill", ""}) {  // what is filled is seen to on the lattice
    options.set_voids(left);
    EXPECT_TRUE(std::isnan(pixel_m(*must_open(file, options), 7, 7))) << left;
  }
  for (const char* wrong : {"holes", "1e9", "nan", "7m", "-501", "-9999"}) {
    options.set_voids(wrong);
    EXPECT_EQ(problem_type(file, options), "option-invalid") << wrong;
  }
  EXPECT_THAT(open(file, options).problem().detail, ::testing::HasSubstr("nodata=-9999"));
  options.set_voids("hole");
  options.set_fill_limit(1025);
  EXPECT_EQ(problem_type(file, options), "option-invalid");
}

TEST_F(Value, UnstoredBlocksOfASparseFileAreVoid) {
  Spec spec = aligned("Float32");
  spec.columns = spec.rows = 512;
  spec.create = {"SPARSE_OK=TRUE", "TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128", "COMPRESS=DEFLATE"};
  spec.value = [](int c, int r) { return c >= 128 && c < 256 && r >= 128 && r < 256 ? 5.0 : 0.0; };
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().nodata(), "unstored blocks");
  EXPECT_EQ(pixel_m(*source, 200, 200), 5);
  EXPECT_TRUE(std::isnan(pixel_m(*source, 300, 200)));
  EXPECT_TRUE(source->empty(lattice(kLevel), 70300, 50000 - 400, 60, 60));
  EXPECT_FALSE(source->empty(lattice(kLevel), 70100, 50000 - 200, 60, 60));
  EXPECT_TRUE(source->empty(lattice(kLevel), 10, 10, 60, 60));
}

TEST_F(Value, Bbox) {
  Spec spec = aligned("Float32");
  const std::string file = write(spec);
  const proto::Lattice l = lattice(kLevel);
  proto::BuildOptions options = plain_options();
  for (const double v : {l.longitude_deg(70002), l.latitude_deg(50000 - 6), l.longitude_deg(70005), l.latitude_deg(50000 - 3)})
    options.add_bbox(v);
  const auto source = must_open(file, options);
  ASSERT_TRUE(source);
  const auto w = source->window(l);
  EXPECT_EQ(w.west, 70002);
  EXPECT_EQ(w.east, 70005);
  EXPECT_EQ(w.south, 49994);
  EXPECT_EQ(w.north, 49997);
  EXPECT_TRUE(std::isnan(height_m(*source, l, 70001, 49995)));
  EXPECT_EQ(height_m(*source, l, 70002, 49995), 100);
  options.set_bbox(0, 100), options.set_bbox(2, 110);
  EXPECT_EQ(problem_type(file, options), "bbox-outside-raster");
  options.set_bbox(1, 60);
  EXPECT_EQ(problem_type(file, options), "option-invalid");
}

/// Refused where the raster does not reach the antimeridian, since two of its sides would be left of it.
TEST_F(Value, BboxWithWestAndEastSwapped) {
  const auto opened = [&](double raster_west, int columns, double west, double east) {
    Spec spec;
    spec.columns = columns, spec.rows = 20, spec.geotransform = {raster_west, 0.25, 0, 10, 0, -0.25};
    proto::BuildOptions options = plain_options();
    for (const double v : {west, 6.0, east, 9.0}) options.add_bbox(v);
    return open(write(spec), options);
  };
  // The last two have one end beyond the raster, and would leave a rim of it.
  for (const auto& [west, east] : {std::pair{13.5, 11.0}, std::pair{14.0, 10.0}, std::pair{13.5, 9.5}, std::pair{14.5, 10.5}}) {
    const auto refused = opened(10, 16, west, east);
    ASSERT_FALSE(refused.ok()) << west;
    EXPECT_EQ(refused.problem().type, "option-invalid");
    EXPECT_EQ(refused.problem().parameter, "bbox");
    EXPECT_THAT(refused.problem().detail, ::testing::HasSubstr("leave out the middle"));
    std::ostringstream swapped;
    swapped << east << ",6," << west << ",9";
    EXPECT_THAT(refused.problem().accepted, ::testing::HasSubstr(swapped.str()));
  }
  struct Meant {
    double raster_west;
    int columns;
    double west, east;
  };
  const Meant meant[] = {{10, 16, 11, 13.5},        // west below east
                         {10, 16, 11, -170},        // one end in the raster
                         {175, 40, 177, -177},      // over the antimeridian
                         {-180, 1440, 170, -170},   // all around
                         {-179, 1432, 170, -170}};  // nearly
  for (const Meant& k : meant) {
    EXPECT_TRUE(opened(k.raster_west, k.columns, k.west, k.east).ok()) << k.raster_west << " " << k.west << " " << k.east;
  }
}

}  // namespace
}  // namespace cordillera::raster_test
