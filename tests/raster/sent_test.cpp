// Every format, as one file or with its side files in a zip: the heights are those of the GeoTIFF, posted and from the command
// line.
#include <filesystem>

#include <gmock/gmock.h>

#include "sent.h"

namespace cordillera::raster_test {
namespace {

using raster::Trust;

class Sent : public RasterTest {
 protected:
  std::vector<std::pair<std::string, std::string>> made(const SentRow& row) {
    Spec spec = hills();
    spec.driver = row.driver, spec.type = row.type, spec.create = row.create;
    return files_of(row, write(spec, row.file));
  }
};

TEST_F(Sent, HeightsAreThoseOfTheGeoTiff) {
  const auto tiff = must_open(write(hills(), "good.tif"));
  ASSERT_TRUE(tiff);
  for (const SentRow& row : sent_rows()) {
    SCOPED_TRACE(row.name);
    const auto files = made(row);
    proto::BuildOptions options = plain_options();
    if (!row.says_crs) options.set_crs("EPSG:4326");
    if (!row.says_nodata()) options.set_nodata("-9999");
    const auto here = must_open(files.front().second, options);
    ASSERT_TRUE(here);
    EXPECT_EQ(here->description().driver(), row.driver);
    EXPECT_EQ(here->description().file(), row.file);
    expect_same_heights(*tiff, *here);

    const std::string zip = path("dem.zip");
    zip_files(zip, files);
    const auto unpacked = must_open(zip, options, Trust::posted_file, "dem.zip");
    ASSERT_TRUE(unpacked);
    EXPECT_EQ(unpacked->description().file(), std::string("dem.zip/") + row.file);
    expect_same_heights(*tiff, *unpacked);

    if (row.beside.empty()) {
      const auto posted = must_open(files.front().second, options, Trust::posted_file, row.file);
      ASSERT_TRUE(posted);
      expect_same_heights(*tiff, *posted);
    }
    if (!row.says_crs) { EXPECT_EQ(problem_type(zip, plain_options(), Trust::posted_file, "dem.zip"), "raster-without-crs"); }
    std::filesystem::remove(zip);
  }
}

TEST_F(Sent, WhatNeedsItsSideFilesSaysSo) {
  for (const SentRow& row : sent_rows()) {
    if (row.beside.empty() || std::string(row.driver) == "AAIGrid") continue;
    SCOPED_TRACE(row.name);
    const auto file = made(row).front().second;
    const auto posted = open(file, plain_options(), Trust::posted_file, row.file);
    ASSERT_FALSE(posted.ok());
    EXPECT_EQ(posted.problem().type, "raster-format-unsupported");
    EXPECT_EQ(posted.problem().accepted, std::string("all files of the raster in one .zip, or in one form: curl -F file=@") +
                                             row.file + " -F file=@" + row.beside.front());
  }
  for (const char* side : {"dem.hdr", "DEM.SGRD"})
    EXPECT_THAT(open(write_text("ncols 3", side)).problem().line(),
                ::testing::HasSubstr("goes with a raster, and is none itself"));
}

/// As editors and spreadsheets write text: with a byte order mark, alone and in a zip, and the CRS beside it.
TEST_F(Sent, AByteOrderMarkIsNoPartOfATextsFirstWord) {
  const auto tiff = must_open(write(hills(), "good.tif"));
  ASSERT_TRUE(tiff);
  for (const SentRow& row : sent_rows()) {
    const bool points = std::string(row.driver) == "XYZ";
    if (!points && std::string(row.driver) != "AAIGrid") continue;
    SCOPED_TRACE(row.name);
    auto files = made(row);
    const std::string name = "marked" + std::filesystem::path(row.file).extension().string();
    files.front() = {name, write_text("\xef\xbb\xbf" + bytes_of(files.front().second), name)};
    if (!points) files.back() = {"marked.prj", write_text(bytes_of(files.back().second), "marked.prj")};
    proto::BuildOptions options = plain_options();
    if (points) options.set_crs("EPSG:4326"), options.set_nodata("-9999");
    const auto here = must_open(files.front().second, options);
    ASSERT_TRUE(here);
    expect_same_heights(*tiff, *here);
    zip_files(path("marked.zip"), files);
    const auto unpacked = must_open(path("marked.zip"), options, Trust::posted_file, "marked.zip");
    ASSERT_TRUE(unpacked);
    expect_same_heights(*tiff, *unpacked);
    std::filesystem::remove(path("marked.zip"));
    if (!points) { EXPECT_EQ(problem_type(files.front().second, options, Trust::posted_file, name), "raster-without-crs"); }
  }
}

/// Half of the heights, with the whole header: it is told, if not by opening, then by reading.
TEST_F(Sent, CutOnesAreDamaged) {
  for (const SentRow& row : sent_rows()) {
    if (row.beside.empty() || std::string(row.driver) == "AAIGrid") continue;
    SCOPED_TRACE(row.name);
    auto files = made(row);
    const std::string data = std::string(row.driver) == "ERS" ? files.back().second : files.front().second;
    const std::string bytes = bytes_of(data);
    write_text(bytes.substr(0, bytes.size() / 2), std::filesystem::path(data).filename());
    zip_files(path("cut.zip"), files);
    proto::BuildOptions options = plain_options();
    if (!row.says_crs) options.set_crs("EPSG:4326");
    auto source = open(path("cut.zip"), options, Trust::posted_file, "cut.zip");
    std::string slug = source.ok() ? "" : source.problem().type;
    if (source.ok()) {
      const proto::Lattice l = lattice(8);
      const auto w = (*source)->window(l);
      const auto samples = (*source)->sample(l, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                                             static_cast<std::int32_t>(w.north - w.south + 1));
      slug = samples.ok() ? "heights" : samples.problem().type;
    }
    EXPECT_EQ(slug, std::string(row.driver) == "SAGA" ? "raster-unreadable" : "raster-truncated");
    std::filesystem::remove(path("cut.zip"));
  }
}

/// 30" cells of one degree: DTED has no other.
TEST_F(Sent, DtedAndHgt) {
  Spec spec = hills();
  spec.nodata = -32767;
  spec.columns = spec.rows = 121;
  spec.value = [](int c, int r) { return 3 * c + 5 * r; };
  spec.geotransform = {-72 - 1 / 240.0, 1 / 120.0, 0, 45 + 1 / 240.0, 0, -1 / 120.0};
  spec.point = true;
  const auto small = must_open(write(spec, "good.tif"));
  spec.driver = "DTED";
  const std::string dted = write(spec, "n44.dt0");
  spec.columns = spec.rows = 1201, spec.nodata = -32768;
  spec.geotransform = {-72 - 1 / 2400.0, 1 / 1200.0, 0, 45 + 1 / 2400.0, 0, -1 / 1200.0};
  spec.driver = "GTiff";
  const auto large = must_open(write(spec, "large.tif"));
  spec.driver = "SRTMHGT";
  const std::string hgt = write(spec, "N44W072.hgt"), zip = path("N44W072.SRTMGL3.hgt.zip"), gz = path("N44W072.hgt.gz");
  ASSERT_TRUE(small && large);
  for (const Trust trust : {Trust::operator_file, Trust::posted_file}) {
    const auto posted = must_open(dted, plain_options(), trust, "n44.dt0");
    ASSERT_TRUE(posted);
    EXPECT_EQ(posted->description().driver(), "DTED");
    expect_same_heights(*small, *posted);
  }
  zip_files(zip, {{"N44W072.hgt", hgt}});
  gzip_file(gz, hgt);
  for (const std::string& archive : {zip, gz}) {
    const auto posted = must_open(archive, plain_options(), Trust::posted_file, std::filesystem::path(archive).filename());
    ASSERT_TRUE(posted) << archive;
    EXPECT_EQ(posted->description().driver(), "SRTMHGT");
    expect_same_heights(*large, *posted);
  }
}

/// DGM1 as surveys publish it: rows from the south, points between 0 and 1 m apart, columns by name.
TEST_F(Sent, PointsInOtherOrders) {
  const auto value = [](int c, int r) { return 100 + c * 2 + r; };
  std::string from_south, by_name = "y;z;x\n", columns;
  for (int r = 0; r < 9; ++r)
    for (int c = 0; c < 8; ++c)
      from_south +=
          std::to_string(500000 + c) + ".5 " + std::to_string(5300000 + r) + ".5 " + std::to_string(value(c, r)) + ".25\n";
  for (int r = 8; r >= 0; --r)
    for (int c = 0; c < 8; ++c)
      by_name += std::to_string(5300000 + r) + ".5;" + std::to_string(value(c, r)) + ".25;" + std::to_string(500000 + c) + ".5\n";
  for (int c = 0; c < 8; ++c)
    for (int r = 0; r < 9; ++r)
      columns += std::to_string(500000 + c) + ".5," + std::to_string(5300000 + r) + ".5," + std::to_string(value(c, r)) + ".25\n";
  Spec spec;
  spec.columns = 8, spec.rows = 9, spec.crs = "EPSG:25832", spec.geotransform = {500000, 1, 0, 5300009, 0, -1};
  spec.value = [&](int c, int r) { return value(c, 8 - r) + 0.25; };
  const auto good = must_open(write(spec, "good.tif"));
  ASSERT_TRUE(good);
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:25832");
  for (const auto& [name, text] :
       {std::pair{"from the south", from_south}, {"columns by name", by_name}, {"column by column", columns}}) {
    SCOPED_TRACE(name);
    const auto posted =
        must_open(write_text(text, std::string(name) + ".xyz"), options, Trust::posted_file, "dgm1_32_500_5300.xyz");
    ASSERT_TRUE(posted);
    EXPECT_EQ(posted->description().columns(), 8u);
    const proto::Lattice l = lattice(17);
    EXPECT_EQ(whole(*posted, l).height, whole(*good, l).height);
  }
}

TEST_F(Sent, WhatIsRefusedIsToldHowItIsConverted) {
  const auto refused =
      open(write_text(std::string(5000, '\x07'), "my dem.bag"), plain_options(), Trust::posted_file, "my dem.bag");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "raster-format-unsupported");
  EXPECT_NE(refused.problem().accepted.find("gdal_translate 'my dem.bag' 'my dem.tif'"), std::string::npos)
      << refused.problem().accepted;
  const auto picture = open(write_text("\x89PNG\r\n\x1a\n", "h.png"), plain_options(), Trust::posted_file, "h.png");
  ASSERT_FALSE(picture.ok());
  EXPECT_NE(picture.problem().accepted.find("gdal_translate h.png h.tif"), std::string::npos);
  // Of what lies in an archive the line is for the unpacked file.
  const std::string png = write_text("\x89PNG\r\n\x1a\n", "h.png");
  zip_files(path("z.zip"), {{"h.png", png}});
  gzip_file(path("h.png.gz"), png);
  for (const auto& [file, line] :
       {std::pair{"z.zip", "gdal_translate h.png h.tif"}, std::pair{"h.png.gz", "gdal_translate h.png h.tif"}}) {
    const auto packed = open(path(file), plain_options(), Trust::posted_file, file);
    ASSERT_FALSE(packed.ok());
    EXPECT_NE(packed.problem().accepted.find(line), std::string::npos) << packed.problem().accepted;
  }
}

}  // namespace
}  // namespace cordillera::raster_test
