// Whether a raster is what it was.
#include <gdal_priv.h>

#include <chrono>
#include <set>

#include "raster/open/raster_state.h"
#include "raster/storage/storage.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

namespace fs = std::filesystem;

class RasterState : public RasterTest {
 protected:
  std::string state(const std::string& name, raster::Trust trust = raster::Trust::operator_file) const {
    return raster::state_of_raster(path(name), trust);
  }
  /// As if it had been written a second later.
  void touch(const std::string& name) const {
    fs::last_write_time(path(name), fs::last_write_time(path(name)) + std::chrono::seconds(1));
  }
  /// As gdalinfo -stats and viewers do: GDAL keeps them, and what it was told when it opened the raster, in an .aux.xml.
  void keep_statistics(const std::string& name) const {
    GDALDatasetUniquePtr raster(GDALDataset::Open(path(name).c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY));
    ASSERT_TRUE(raster);
    raster->GetMetadata();
    GDALRasterBand& band = *raster->GetRasterBand(1);
    band.GetMetadata();
    double least = 0, greatest = 0, mean = 0, deviation = 0;
    ASSERT_EQ(band.ComputeStatistics(0, &least, &greatest, &mean, &deviation, nullptr, nullptr), CE_None);
    raster.reset();
    ASSERT_TRUE(fs::exists(path(name + ".aux.xml")));
  }
  std::string vrt_of(const std::string& member) const {
    return "<VRTDataset rasterXSize=\"8\" rasterYSize=\"8\"><SRS>EPSG:4326</SRS><GeoTransform>10,0.01,0,45,0,-0.01</GeoTransform>"
           "<VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">" +
           member + "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>";
  }
};

TEST_F(RasterState, is_that_of_its_file_and_of_what_lies_beside_it) {
  EXPECT_EQ(state("dem.tif"), "");
  write({}, "dem.tif");
  std::string before = state("dem.tif");
  EXPECT_NE(before, "");
  const std::string stranger = state("dem.tif", raster::Trust::posted_file);
  for (const char* beside : {"dem.tif.msk", "dem.tfw", "dem.PRJ"}) {
    write_text("1", beside);
    const std::string with_it = state("dem.tif");
    EXPECT_NE(with_it, before) << beside;
    touch(beside);
    EXPECT_NE(state("dem.tif"), with_it) << beside;
    before = state("dem.tif");
  }
  // A viewer's statistics and pyramids change no tile.
  for (const char* beside : {"dem.tif.aux.xml", "dem.tif.ovr", "other.tif", "dem.txt"}) write_text("1", beside);
  EXPECT_EQ(state("dem.tif"), before);
  EXPECT_EQ(state("dem.tif", raster::Trust::posted_file), stranger) << "it came alone";
}

TEST_F(RasterState, is_that_of_what_notes_beside_it_say_of_heights_and_not_of_statistics) {
  write({}, "dem.tif");
  write_text(vrt_of("dem.tif"), "all.vrt");
  const std::string bare = state("dem.tif"), bare_vrt = state("all.vrt");
  const auto notes = [&](const std::string& dataset, const std::string& band) {
    write_text("<PAMDataset>" + dataset + "<PAMRasterBand band=\"1\">" + band + "</PAMRasterBand></PAMDataset>",
               "dem.tif.aux.xml");
  };
  const std::string statistics =
      "<Histograms><HistItem><HistMin>1</HistMin></HistItem></Histograms>"
      "<Metadata><MDI key=\"STATISTICS_MAXIMUM\">9</MDI></Metadata>";
  notes("<Metadata domain=\"Esri\"><MDI key=\"PyramidResamplingType\">NEAREST</MDI></Metadata>", statistics);
  EXPECT_EQ(state("dem.tif"), bare);
  EXPECT_EQ(state("all.vrt"), bare_vrt);
  std::set<std::string> states{bare}, of_vrt{bare_vrt};
  for (const char* said : {"<Offset>500</Offset>", "<Offset>501</Offset>", "<Scale>2</Scale>", "<NoDataValue>1400</NoDataValue>",
                           "<UnitType>ft</UnitType>", "<Description>elevation</Description>",
                           "<Metadata><MDI key=\"positive\">down</MDI></Metadata>"}) {
    notes("", said);
    const std::string alone = state("dem.tif");
    EXPECT_TRUE(states.insert(alone).second) << said;
    EXPECT_TRUE(of_vrt.insert(state("all.vrt")).second) << said;
    notes("", said + statistics);
    touch("dem.tif.aux.xml");
    EXPECT_EQ(state("dem.tif"), alone) << said << ", with statistics";
  }
  notes("<SRS>EPSG:4258</SRS>", "");
  EXPECT_TRUE(states.insert(state("dem.tif")).second);
  write_text("no XML <", "dem.tif.aux.xml");
  EXPECT_EQ(state("dem.tif"), bare);
  fs::remove(path("dem.tif.aux.xml"));
  EXPECT_EQ(state("dem.tif"), bare);
}

/// Raster of whole metres with its first sample on 47 N 7 E, so many to the degree.
Spec cell(const char* driver, int steps) {
  Spec spec;
  spec.driver = driver, spec.type = "Int16", spec.columns = spec.rows = steps + 1, spec.point = true;
  spec.geotransform = {7 - 0.5 / steps, 1.0 / steps, 0, 47 + 0.5 / steps, 0, -1.0 / steps};
  return spec;
}

TEST_F(RasterState, stays_when_GDAL_keeps_statistics_beside_it) {
  write({}, "plain.tif");
  Spec point;
  point.point = true, point.bands = 2;
  write(point, "named.tif");
  {
    GDALDatasetUniquePtr named(GDALDataset::Open(path("named.tif").c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    ASSERT_TRUE(named);
    named->GetRasterBand(1)->SetDescription("elevation");
    named->GetRasterBand(2)->SetDescription("error");
    named->GetRasterBand(1)->SetMetadataItem("positive", "up");
  }
  for (const auto& [driver, name] :
       {std::pair("HFA", "dem.img"), {"netCDF", "dem.nc"}, {"SAGA", "dem.sdat"}, {"AAIGrid", "dem.asc"}}) {
    Spec spec;
    spec.driver = driver;
    write(spec, name);
  }
  write(cell("SRTMHGT", 1200), "N46E007.hgt");
  write(cell("DTED", 120), "dem.dt0");
  for (const char* name : {"plain.tif", "named.tif", "dem.img", "dem.nc", "dem.sdat", "dem.asc", "N46E007.hgt", "dem.dt0"}) {
    SCOPED_TRACE(name);
    fs::remove(path(std::string(name) + ".aux.xml"));  // what a driver wrote there with the raster
    const std::string before = state(name);
    keep_statistics(name);
    EXPECT_EQ(state(name), before);
  }
}

TEST_F(RasterState, is_another_where_notes_say_other_than_the_raster) {
  Spec two;
  two.bands = 2;
  write(two, "dem.tif");
  {
    GDALDatasetUniquePtr dem(GDALDataset::Open(path("dem.tif").c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    ASSERT_TRUE(dem);
    dem->GetRasterBand(2)->SetDescription("elevation");
  }
  const std::string bare = state("dem.tif");
  const auto with = [&](const std::string& notes) {
    write_text("<PAMDataset>" + notes + "</PAMDataset>", "dem.tif.aux.xml");
    return state("dem.tif");
  };
  EXPECT_EQ(with("<PAMRasterBand band=\"2\"><Description>elevation</Description></PAMRasterBand>"), bare);
  EXPECT_EQ(with("<Metadata><MDI key=\"AREA_OR_POINT\">Area</MDI><MDI key=\"AUTHOR\">me</MDI></Metadata>"), bare);
  EXPECT_NE(with("<PAMRasterBand band=\"2\"><Description>error</Description></PAMRasterBand>"), bare);
  EXPECT_NE(with("<PAMRasterBand band=\"1\"><Description>elevation</Description></PAMRasterBand>"), bare);
  EXPECT_NE(with("<PAMRasterBand band=\"3\"><Description>elevation</Description></PAMRasterBand>"), bare);
  EXPECT_NE(with("<Metadata><MDI key=\"AREA_OR_POINT\">Point</MDI></Metadata>"), bare);
}

TEST_F(RasterState, of_a_vrt_is_that_of_all_rasters_below_it) {
  write({}, "dem.tif");
  write_text(vrt_of("dem.tif"), "inner.vrt");
  write_text(vrt_of("inner.vrt"), "outer.vrt");
  const std::string before = state("outer.vrt");
  touch("dem.tif");
  const std::string after = state("outer.vrt");
  EXPECT_NE(after, before);
  EXPECT_EQ(after.substr(0, after.find(',')), before.substr(0, before.find(','))) << "the VRT itself is as it was";
  const fs::path here = fs::current_path();
  fs::current_path(fs::path(path("outer.vrt")).parent_path());
  EXPECT_EQ(raster::state_of_raster("outer.vrt", raster::Trust::operator_file), after) << "however it is named";
  EXPECT_EQ(raster::state_of_raster("../" + fs::current_path().filename().string() + "/outer.vrt", raster::Trust::operator_file),
            after);
  fs::current_path(here);
  // A raster that is named by its whole path, below a VRT that is not.
  std::string whole = vrt_of(path("dem.tif"));
  whole.replace(whole.find("relativeToVRT=\"1\""), 17, "relativeToVRT=\"0\"");
  write_text(whole, "whole.vrt");
  fs::current_path(fs::path(path("whole.vrt")).parent_path());
  const std::string up = "../" + fs::current_path().filename().string() + "/whole.vrt";
  EXPECT_EQ(raster::state_of_raster(up, raster::Trust::operator_file), state("whole.vrt"));
  fs::current_path(here);
  write_text(vrt_of("outer.vrt"), "outer.vrt");  // names itself
  EXPECT_NE(state("outer.vrt"), "");
}

TEST(ToldState, HasADate) {
  EXPECT_EQ(raster::told_state("723330 bytes, 1700000000"), "723330 bytes of 2023-11-14 22:13:20.000 UTC");
  EXPECT_EQ(raster::told_state("5 bytes, -4641751355783222001, and 1 file with it: ab"),
            "5 bytes of 2026-11-29 00:37:24.216 UTC, and 1 file with it: ab");
  for (const char* other : {"", "an etag", "5 bytes, soon"}) EXPECT_EQ(raster::told_state(other), other);
}

}  // namespace
}  // namespace cordillera::raster_test
