// Which band of a file, and which of several rasters in one, holds the heights.
#include <gdal_priv.h>

#include <cstdint>
#include <filesystem>

#include "raster/open/dataset.h"
#include "raster/pixels/decimation.h"
#include "sent.h"

namespace cordillera::raster_test {
namespace {

using raster::Trust;

class Band : public RasterTest {
 protected:
  /// Bands of 101, 102, … m, called as in names.
  std::string bands(const std::string& driver, const std::string& file, const std::vector<std::string>& names) {
    GDALAllRegister();
    GDALDriver* const memory = GetGDALDriverManager()->GetDriverByName("MEM");
    const GDALDatasetUniquePtr made(memory->Create("", 8, 6, static_cast<int>(names.size()), GDT_Float32, nullptr));
    double place[6] = {10, 0.01, 0, 45, 0, -0.01};
    made->SetGeoTransform(place);
    OGRSpatialReference crs;
    crs.importFromEPSG(4326);
    made->SetSpatialRef(&crs);
    for (std::size_t k = 0; k < names.size(); ++k) {
      GDALRasterBand& band = *made->GetRasterBand(static_cast<int>(k) + 1);
      band.Fill(101 + static_cast<double>(k));
      band.SetDescription(names[k].c_str());
      band.SetMetadataItem("NETCDF_VARNAME", names[k].c_str());
    }
    GDALDriver* const target = GetGDALDriverManager()->GetDriverByName(driver.c_str());
    EXPECT_TRUE(GDALDatasetUniquePtr(target->CreateCopy(path(file).c_str(), made.get(), FALSE, nullptr, nullptr, nullptr)))
        << CPLGetLastErrorMsg();
    return path(file);
  }
  /// GDAL numbers the variables that it writes ("z1", "height2"): without their numbers, as everybody else's.
  std::string without_numbers(const std::string& file, const std::vector<std::string>& names) {
    std::string bytes = bytes_of(file);
    for (std::size_t k = 0; k < names.size(); ++k) {
      const std::string numbered = names[k] + std::to_string(k + 1);
      const std::size_t at = bytes.find(std::string("\0\0\0", 3) + static_cast<char>(numbered.size()) + numbered);
      EXPECT_NE(at, std::string::npos) << numbered;
      if (at == std::string::npos) continue;
      bytes[at + 3] = static_cast<char>(names[k].size());  // padded to four bytes, the shorter name is as long
      bytes[at + 4 + names[k].size()] = '\0';
    }
    return write_text(bytes, std::filesystem::path(file).filename());
  }
  /// The height of every pixel; the slug where there is none.
  static std::string height(const std::string& file, const std::string& band, Trust trust = Trust::posted_file) {
    const auto dataset = raster::open_dataset(file, "", trust, band);
    if (!dataset.ok()) return dataset.problem().type;
    double value = 0;
    EXPECT_EQ(dataset->band->RasterIO(GF_Read, 1, 1, 1, 1, &value, 1, 1, GDT_Float64, 0, 0, nullptr), CE_None);
    return std::to_string(static_cast<int>(value));
  }
};

TEST_F(Band, ByNumberOrName) {
  const std::string file = bands("GTiff", "dem.tif", {"dsm", "dtm", "slope"});
  EXPECT_EQ(height(file, ""), "raster-bands");
  for (const auto& [band, value] : {std::pair{"1", "101"},
                                    {"2", "102"},
                                    {"3", "103"},
                                    {"dtm", "102"},
                                    {"4", "raster-bands"},
                                    {"0", "raster-bands"},
                                    {"-1", "raster-bands"},
                                    {"DTM", "102"},
                                    {"DTM ", "raster-bands"}})
    EXPECT_EQ(height(file, band), value) << band;
  const auto several = raster::open_dataset(file, "", Trust::posted_file, "");
  ASSERT_FALSE(several.ok());
  EXPECT_EQ(several.problem().detail, "dem.tif has 3 bands (1 dsm, 2 dtm, 3 slope); an elevation model has one");
  EXPECT_EQ(several.problem().accepted, "band= with a number from 1 to 3, or a band's name");
  EXPECT_EQ(several.problem().parameter, "band");
}

/// As of a NetCDF variable with a time.
TEST_F(Band, OfOneNameAreToldApartByNumbers) {
  const std::string file = bands("GTiff", "times.tif", {"elevation", "elevation", "elevation"});
  const auto refused = raster::open_dataset(file, "", Trust::posted_file, "elevation");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().detail,
            "times.tif has 3 bands (1 elevation, 2 elevation, 3 elevation), and more than one is called elevation");
  EXPECT_EQ(refused.problem().accepted, "band= with a number from 1 to 3");
  EXPECT_EQ(height(file, "2"), "102");
  EXPECT_EQ(raster::open_dataset(file, "", Trust::posted_file, "").problem().accepted, "band= with a number from 1 to 3");
  EXPECT_EQ(raster::open_dataset(file, "", Trust::posted_file, "dtm").problem().detail,
            "times.tif has 3 bands (1 elevation, 2 elevation, 3 elevation), and none of them is dtm");
  const std::string some = bands("GTiff", "some.tif", {"elevation", "Elevation", "slope"});
  EXPECT_EQ(height(some, "elevation"), "101") << "written as that band is";
  EXPECT_EQ(height(some, "ELEVATION"), "raster-bands");
  EXPECT_EQ(raster::open_dataset(some, "", Trust::posted_file, "").problem().accepted,
            "band= with a number from 1 to 3, or a band's name");
}

TEST_F(Band, APictureIsToldSo) {
  Spec spec;
  spec.bands = 3, spec.type = "Byte", spec.create = {"PHOTOMETRIC=RGB"};
  const auto refused = open(write(spec, "rgb.tif"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "raster-bands");
  EXPECT_EQ(refused.problem().detail, "rgb.tif is a picture of 3 bands: its pixels are colours, which are no heights");
  EXPECT_NE(refused.problem().accepted.find("gdal_calc.py -R rgb.tif -G rgb.tif -B rgb.tif"), std::string::npos);
  auto options = plain_options();
  options.set_band("1");
  const auto chosen = must_open(path("rgb.tif"), options);
  ASSERT_TRUE(chosen);
  ASSERT_EQ(chosen->description().notes_size(), 1);
  EXPECT_EQ(chosen->description().notes(0), "rgb.tif is a picture, and its band 1, red, is taken for heights");
  options.set_band("4");
  EXPECT_EQ(open(path("rgb.tif"), options).problem().detail, "rgb.tif has 3 bands, and none of them is 4");
  spec.create.clear(), spec.bands = 4;
  EXPECT_EQ(open(write(spec, "bytes.tif")).problem().detail,
            "bytes.tif is a picture of 4 bands: its pixels are colours, which are no heights");
  spec.type = "Float32";  // no colours
  EXPECT_EQ(open(write(spec, "floats.tif")).problem().detail, "floats.tif has 4 bands; an elevation model has one");
  options.set_band("1");
  EXPECT_EQ(must_open(path("floats.tif"), options)->description().notes_size(), 0);
}

TEST_F(Band, OfSeveralTheOnlyOneThatIsCalledAsHeightsAre) {
  EXPECT_EQ(height(bands("GTiff", "gee.tif", {"slope", "elevation", "aspect"}), ""), "102");
  EXPECT_EQ(height(path("gee.tif"), "slope"), "101");
  EXPECT_EQ(height(bands("GTiff", "colours.tif", {"band1", "band2", "band3"}), ""), "raster-bands");
}

TEST_F(Band, OfNetcdfTheVariableThatIsCalledAsHeightsAre) {
  const std::string gebco = without_numbers(bands("netCDF", "gebco.nc", {"tid", "elevation"}), {"tid", "elevation"});
  EXPECT_EQ(height(gebco, ""), "102");
  EXPECT_EQ(height(gebco, "", Trust::operator_file), "102");
  EXPECT_EQ(height(gebco, "tid"), "101");
  EXPECT_EQ(height(gebco, "elevation"), "102");
  EXPECT_EQ(height(gebco, "Elevation"), "102");
  EXPECT_EQ(height(gebco, "depth"), "raster-bands");
  const std::string two = without_numbers(bands("netCDF", "two.nc", {"z", "height"}), {"z", "height"});
  EXPECT_EQ(height(two, ""), "raster-bands");
  EXPECT_EQ(height(two, "z"), "101");
  const auto several = raster::open_dataset(two, "", Trust::posted_file, "");
  ASSERT_FALSE(several.ok());
  EXPECT_EQ(several.problem().detail, "two.nc holds 2 rasters, z, height, and none alone is called as heights are");
}

/// As GMT and GEBCO write them: coordinates in degrees_north and degrees_east, and no grid mapping.
TEST_F(Band, OfNetcdfDegreesWithoutACrsAreThoseOfWgs84) {
  std::string bytes = bytes_of(bands("netCDF", "coards.nc", {"z"}));
  const auto spoil = [&bytes](const std::string& word) {
    ASSERT_NE(bytes.find(word), bytes.npos) << word;
    for (std::size_t at = 0; (at = bytes.find(word, at)) != bytes.npos;) bytes[at + word.size() - 1] = 'X';
  };
  for (const char* word : {"grid_mapping", "spatial_ref", "crs_wkt", "GeoTransform"}) spoil(word);
  const auto source = must_open(write_text(bytes, "gmt.nc"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().crs(), "WGS 84 (EPSG:4326)");
  EXPECT_EQ(source->description().crs_from(), "source");
  EXPECT_NEAR(source->description().bbox(0), 10, 1e-6);
  const auto few = source->decimate(100);
  ASSERT_TRUE(few.ok() && *few);
  const auto thin = raster::open_decimated(path("gmt.nc"), "", raster::Trust::operator_file, plain_options(), *few);
  ASSERT_TRUE(thin.ok()) << thin.problem().line();
  EXPECT_EQ((*thin)->description().crs(), "WGS 84 (EPSG:4326)");
  proto::BuildOptions other = plain_options();
  other.set_crs("EPSG:4258");
  EXPECT_EQ(must_open(write_text(bytes, "etrs.nc"), other)->description().crs_from(), "request");
  spoil("degrees_north");
  EXPECT_EQ(problem_type(write_text(bytes, "other.nc")), "raster-without-crs");
}

/// A NetCDF file of the old kind, of 8 x 6 pixels of 101 m and more at 10 E, 45 N.
struct OldNetcdf {
  bool turned = false;   ///< longitudes down the rows
  double shift_deg = 0;  ///< of a row in the middle
  std::string longitude_unit = "degrees_east", latitude_unit = "degrees_north", longitude_name = "", latitude_name = "",
              positive = "", standard_name = "";
  std::vector<std::pair<std::string, float>> numbers = {};  ///< other attributes of the heights
  std::string x = "lon", y = "lat";
  std::string bytes() const {
    const auto number = [](std::uint32_t value) {
      return std::string{static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
                         static_cast<char>(value)};
    };
    const auto text = [&](const std::string& word) {
      return number(static_cast<std::uint32_t>(word.size())) + word + std::string(-word.size() % 4, '\0');
    };
    const auto big = [](auto value) {
      std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
      return std::string(bytes.rbegin(), bytes.rend());
    };
    const auto attributes = [&](const std::vector<std::pair<std::string, std::string>>& all,
                                const std::vector<std::pair<std::string, float>>& floats = {}) {
      std::string list;
      std::uint32_t count = 0;
      for (const auto& [name, value] : all)
        if (!value.empty()) list += text(name) + number(2) + text(value), ++count;
      for (const auto& [name, value] : floats) list += text(name) + number(5) + number(1) + big(value), ++count;
      return (count == 0 ? number(0) : number(12)) + number(count) + list;
    };
    std::string xs, ys, zs;
    for (int c = 0; c < 8; ++c) xs += big(10.005 + 0.01 * c);
    for (int r = 0; r < 6; ++r) ys += big(44.995 - 0.01 * r + (r == 3 ? shift_deg : 0));
    for (int k = 0; k < 48; ++k) zs += big(turned ? 101.0F + static_cast<float>(k / 6) : 101.0F + static_cast<float>(k % 8));
    const auto head = [&](std::uint32_t at) {
      const auto end = [&](int type, const std::string& values) {
        at += static_cast<std::uint32_t>(values.size());
        return number(static_cast<std::uint32_t>(type)) + number(static_cast<std::uint32_t>(values.size())) +
               number(at - static_cast<std::uint32_t>(values.size()));
      };
      std::string all = "CDF\1" + number(0) + number(10) + number(2) + text(x) + number(8) + text(y) + number(6) +
                        attributes({}) + number(11) + number(3);
      all +=
          text(x) + number(1) + number(0) + attributes({{"units", longitude_unit}, {"long_name", longitude_name}}) + end(6, xs);
      all += text(y) + number(1) + number(1) + attributes({{"units", latitude_unit}, {"long_name", latitude_name}}) + end(6, ys);
      all += text("z") + number(2) + number(turned ? 0 : 1) + number(turned ? 1 : 0) +
             attributes({{"units", "m"}, {"positive", positive}, {"standard_name", standard_name}}, numbers) + end(5, zs);
      return all;
    };
    return head(static_cast<std::uint32_t>(head(0).size())) + xs + ys + zs;
  }
};

/// ETOPO1's: x and y in "degrees", called Longitude and Latitude.
TEST_F(Band, OfNetcdfDegreesThatAreCalledLongitudeAndLatitude) {
  OldNetcdf etopo{
      .longitude_unit = "degrees", .latitude_unit = "degrees", .longitude_name = "Longitude", .latitude_name = "Latitude"};
  etopo.x = "x", etopo.y = "y";
  const auto source = must_open(write_text(etopo.bytes(), "etopo.grd"));
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().crs(), "WGS 84 (EPSG:4326)");
  EXPECT_NEAR(source->description().bbox(0), 10, 1e-6);
  EXPECT_NEAR(source->description().bbox(3), 45, 1e-6);
  etopo.longitude_name = "x", etopo.latitude_name = "y";
  EXPECT_NE(problem_type(write_text(etopo.bytes(), "plain.grd")), "") << "degrees of what";
}

/// GDAL would take them for a raster at 45 E, 10 N.
TEST_F(Band, OfNetcdfMeridiansForRowsAreRefused) {
  ASSERT_TRUE(must_open(write_text(OldNetcdf().bytes(), "rows.nc")));
  for (const Trust trust : {Trust::operator_file, Trust::posted_file}) {
    const auto turned = open(write_text(OldNetcdf{.turned = true}.bytes(), "turned.nc"), plain_options(), trust, "turned.nc");
    ASSERT_FALSE(turned.ok());
    EXPECT_EQ(turned.problem().type, "raster-not-georeferenced");
    EXPECT_EQ(turned.problem().detail, "in turned.nc the rows of z are meridians: it is turned");
    EXPECT_EQ(turned.problem().accepted,
              "rows of equal latitude: `gdalmdimtranslate in.nc out.nc -array name=z,transpose=[1,0]` turns it");
  }
}

/// GDAL takes steps of degrees for even up to a tenth of one.
TEST_F(Band, OfNetcdfUnevenStepsAreRefused) {
  EXPECT_TRUE(must_open(write_text(OldNetcdf{.shift_deg = 0.0009}.bytes(), "rounded.nc")));
  const auto uneven = open(write_text(OldNetcdf{.shift_deg = 0.004}.bytes(), "gauss.nc"), plain_options());
  ASSERT_FALSE(uneven.ok());
  EXPECT_EQ(uneven.problem().type, "raster-not-georeferenced");
  EXPECT_EQ(
      uneven.problem().detail,
      "in gauss.nc the coordinates lat of z are not evenly spaced: they are up to 0.4 steps from where even steps would put "
      "them");
}

TEST_F(Band, OfNetcdfAVariableThatCountsDownwardsHoldsDepths) {
  const proto::Lattice l = lattice(8);
  for (const auto& [positive, height] : {std::pair{"", 104.0}, {"up", 104.0}, {"down", -104.0}, {"Down", -104.0}}) {
    const auto source = must_open(write_text(OldNetcdf{.positive = positive}.bytes(), std::string("sea") + positive + ".nc"));
    ASSERT_TRUE(source);
    const auto w = source->window(l);
    EXPECT_NEAR(height_m(*source, l, (w.west + w.east) / 2, (w.south + w.north) / 2), height, 4) << positive;
  }
}

TEST_F(Band, OfNetcdfStandardNamesOfWhatIsBelowHoldDepths) {
  const proto::Lattice l = lattice(8);
  const auto height = [&](const OldNetcdf& file) {
    const auto source = must_open(write_text(file.bytes(), "sea" + file.standard_name + file.positive + ".nc"));
    if (!source) return 0.0;
    const auto w = source->window(l);
    return height_m(*source, l, (w.west + w.east) / 2, (w.south + w.north) / 2);
  };
  for (const char* below : {"depth", "sea_floor_depth_below_geoid", "sea_floor_depth_below_mean_sea_level"})
    EXPECT_NEAR(height({.standard_name = below}), -104, 4) << below;
  EXPECT_NEAR(height({.standard_name = "surface_altitude"}), 104, 4);
  EXPECT_NEAR(height({.positive = "up", .standard_name = "depth"}), 104, 4) << "the direction is said";
}

/// Columns are 101 to 108 m high.
TEST_F(Band, OfNetcdfAllThatIsDeclaredAsNoDataIsNone) {
  int count = 0;
  const auto valid_columns = [&](const std::vector<std::pair<std::string, float>>& numbers, const std::string& nodata) {
    const auto source = must_open(write_text(OldNetcdf{.numbers = numbers}.bytes(), "voids" + std::to_string(++count) + ".nc"));
    std::string columns;
    for (int c = 0; source && c < 8; ++c) {
      const double longitude = 10.005 + 0.01 * c, latitude = 44.975;
      double height = 0;
      EXPECT_TRUE(source->nearest(std::span(&longitude, 1), std::span(&latitude, 1), &height).ok());
      columns += std::isnan(height) ? '.' : static_cast<char>('0' + std::lround(height) - 100);
    }
    if (source) { EXPECT_EQ(source->description().nodata(), nodata); }
    return columns;
  };
  EXPECT_EQ(valid_columns({}, "value 9.96920997e+36"), "12345678");
  EXPECT_EQ(valid_columns({{"_FillValue", 103}}, "value 103"), "12.45678");
  EXPECT_EQ(valid_columns({{"missing_value", 103}}, "value 103"), "12.45678");
  EXPECT_EQ(valid_columns({{"_FillValue", 103}, {"missing_value", 103}}, "value 103"), "12.45678");
  EXPECT_EQ(valid_columns({{"_FillValue", 103}, {"missing_value", 105}}, "value 103, missing_value 105"), "12.4.678");
  EXPECT_EQ(valid_columns({{"valid_max", 106}}, "value 9.96920997e+36, valid_max 106"), "123456..");
  EXPECT_EQ(valid_columns({{"_FillValue", 101}, {"valid_min", 104}}, "value 101, valid_min 104"), "...45678");
}

/// x and y without a word on what they are: the user's CRS places them.
TEST_F(Band, OfNetcdfCoordinatesThatAreNotDeclaredWaitForACrs) {
  OldNetcdf bare{.longitude_unit = "", .latitude_unit = ""};
  bare.x = "x", bare.y = "y";
  const std::string file = write_text(bare.bytes(), "bare.nc");
  EXPECT_EQ(problem_type(file), "raster-without-crs");
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:4326");
  const auto source = must_open(file, options);
  ASSERT_TRUE(source);
  EXPECT_NEAR(source->description().bbox(0), 10, 1e-6);
  EXPECT_NEAR(source->description().bbox(3), 45, 1e-6);
}

TEST_F(Band, AsAnOption) {
  const std::string file = bands("GTiff", "dem.tif", {"dsm", "dtm"});
  proto::BuildOptions options = plain_options();
  EXPECT_EQ(problem_type(file, options), "raster-bands");
  options.set_band("dtm");
  const auto source = must_open(file, options);
  ASSERT_TRUE(source);
  const proto::Lattice l = lattice(8);
  const auto w = source->window(l);
  EXPECT_NEAR(height_m(*source, l, (w.west + w.east) / 2, (w.south + w.north) / 2), 102, 0.01);
}

TEST_F(Band, OfAGeoPackageTheTable) {
  const std::string file = bands("GPKG", "dem.gpkg", {"one"});
  EXPECT_EQ(height(file, ""), "101");
  EXPECT_EQ(height(file, "1"), "101");
}

}  // namespace
}  // namespace cordillera::raster_test
