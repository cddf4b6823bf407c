// VRTs that stand at an address: which rasters they name, under which names they are read, and what is refused.
#include "raster/mosaic/vrt_rasters.h"

#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/mosaic/source_list.h"
#include "raster/storage/ranged_file.h"

namespace cordillera {
namespace {

using raster::ListKind;
using raster_test::RasterTest;
using raster_test::Spec;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

proto::Result<raster::VrtRasters> taken(const std::string& text) {
  return raster::take_rasters(text, "a.vrt", [](std::size_t k, const std::string&) { return "/there/" + std::to_string(k); });
}

std::string vrt_with(const std::string& inner) {
  return "<VRTDataset rasterXSize=\"2000\" rasterYSize=\"1000\">" + inner + "</VRTDataset>";
}
std::string band_of(const std::string& inner) {
  return vrt_with("<VRTRasterBand dataType=\"Int16\" band=\"1\">" + inner + "</VRTRasterBand>");
}
std::string source_of(const std::string& name, const std::string& relative = "1") {
  return "<ComplexSource><SourceFilename relativeToVRT=\"" + relative + "\" shared=\"0\">" + name +
         "</SourceFilename><NODATA>-1</NODATA></ComplexSource>";
}

TEST(VrtRasters, EachIsNamedOnceAndReadUnderItsNumber) {
  const auto found =
      taken(band_of(source_of("b/one.tif") + source_of("two.tif") + source_of("b/one.tif") +
                    source_of("/vsicurl/https://example.org/3.tif", "0") + source_of("https://example.org/4.tif", "0")));
  ASSERT_TRUE(found.ok()) << found.problem().line();
  EXPECT_EQ(found->written, (std::vector<std::string>{"b/one.tif", "two.tif", "/vsicurl/https://example.org/3.tif",
                                                      "https://example.org/4.tif"}));
  for (const char* is : {">/there/0<", ">/there/1<", ">/there/2<", ">/there/3<", "<NODATA>-1<", "relativeToVRT=\"0\""})
    EXPECT_THAT(found->text, HasSubstr(is));
  EXPECT_THAT(found->text, Not(HasSubstr(".tif")));
  EXPECT_THAT(found->text, Not(HasSubstr("relativeToVRT=\"1\"")));
  EXPECT_THAT(found->text, HasSubstr(">2 4<")) << "overviews of 1000 and 500 columns";
}

TEST(VrtRasters, OverviewsOfItsOwnStay) {
  const auto found =
      taken(vrt_with("<OverviewList>8</OverviewList><VRTRasterBand band=\"1\">" + source_of("a.tif") + "</VRTRasterBand>"));
  ASSERT_TRUE(found.ok());
  EXPECT_THAT(found->text, Not(HasSubstr("2 4")));
}

/// GDAL compares names without regard to case.
TEST(VrtRasters, CapitalsHideNothing) {
  const auto found = taken(band_of("<simplesource><SOURCEFILENAME RELATIVETOVRT=\"1\">a.tif</SOURCEFILENAME></simplesource>"));
  ASSERT_TRUE(found.ok()) << found.problem().line();
  EXPECT_EQ(found->written, std::vector<std::string>{"a.tif"});
  EXPECT_FALSE(taken(vrt_with("<VRTRasterBand SUBCLASS=\"VRTRawRasterBand\">" + source_of("a") + "</VRTRasterBand>")).ok());
}

TEST(VrtRasters, OthersAreRefusedWithWhatIsWrong) {
  const auto why = [](const std::string& text) {
    const auto found = taken(text);
    return found.ok() ? "taken" : found.problem().type + ": " + found.problem().detail;
  };
  EXPECT_THAT(why(band_of("")), HasSubstr("no raster in it"));
  EXPECT_THAT(why(band_of(source_of("/home/me/a.tif", "0"))), HasSubstr("/home/me/a.tif"));
  EXPECT_THAT(why(band_of(source_of(""))), HasSubstr("names no raster"));
  for (const char* other : {"../ok.vrt", "ok.VRT", "/vsicurl/https://me:secret@example.org/ok.vrt?secret=1"})
    EXPECT_THAT(why(band_of(source_of("a.tif") + source_of(other))),
                AllOf(HasSubstr("raster-format-unsupported: a.vrt names another VRT, ok."), Not(HasSubstr("secret"))));
  EXPECT_THAT(why(vrt_with("<VRTRasterBand subClass=\"VRTDerivedRasterBand\">" + source_of("a.tif") + "</VRTRasterBand>")),
              HasSubstr("VRTDerivedRasterBand"));
  EXPECT_THAT(why("<VRTDataset subClass=\"VRTWarpedDataset\"/>"), HasSubstr("VRTWarpedDataset"));
  EXPECT_THAT(why(vrt_with("<GDALWarpOptions><SourceDataset>a.tif</SourceDataset></GDALWarpOptions>")),
              HasSubstr("GDALWarpOptions"));
  EXPECT_THAT(why(band_of("<PixelFunctionCode>import os</PixelFunctionCode>")), HasSubstr("PixelFunctionCode"));
  for (const char* damaged : {"", "<VRTDataset", "<VRTDataset><VRTRasterBand></VRTDataset>", "<Other/>"})
    EXPECT_THAT(why(damaged), HasSubstr("raster-unreadable")) << damaged;
  std::string deep;
  for (int k = 0; k < 100'000; ++k) deep += "<a>";
  EXPECT_THAT(why("<VRTDataset>" + deep), HasSubstr("raster-unreadable"));
}

TEST(ListKinds, AreSeenByTheirFirstBytes) {
  EXPECT_EQ(raster::list_kind("\n {\"type\"", "items"), ListKind::list);
  EXPECT_EQ(raster::list_kind("\xef\xbb\xbf{", "items"), ListKind::list);
  EXPECT_EQ(raster::list_kind("<VRTDataset ", "a.tif"), ListKind::vrt);
  EXPECT_EQ(raster::list_kind("<?xml version=\"1.0\"?>\n<VRTDataset>", "a"), ListKind::vrt);
  EXPECT_EQ(raster::list_kind("a.tif\n", "list.txt"), ListKind::list);
  EXPECT_EQ(raster::list_kind("SQLite format 3", "index.gpkg"), ListKind::list);
  for (const char* head : {"", " ", "II*", "ncols 3", "<?xml", "<html>", "SQLite format 3"})
    EXPECT_EQ(raster::list_kind(head, "a.tif"), ListKind::none) << head;
}

class WrittenIn : public RasterTest {
 protected:
  std::vector<std::string> names(const std::string& text, const std::string& name) {
    const auto listed = raster::written_in(write_text(text, "list"), name);
    if (!listed.ok()) return {listed.problem().type};
    std::vector<std::string> all;
    for (const auto& source : *listed) all.push_back(source.path);
    return all;
  }
};

using Names = std::vector<std::string>;

TEST_F(WrittenIn, PathsStayAsTheyStandThere) {
  EXPECT_EQ(names(R"({"sources":[{"path":"../a.tif"},{"path":"s3://b/c.tif"}]})", "dem"), (Names{"../a.tif", "s3://b/c.tif"}));
  EXPECT_EQ(names("a.tif nodata=3\n/b.tif\n", "list.txt"), (Names{"a.tif", "/b.tif"}));
  EXPECT_EQ(
      names(R"({"type":"FeatureCollection","features":[{"type":"Feature","geometry":null,"properties":{"location":"a/b.tif"}}]})",
            "i"),
      Names{"a/b.tif"});
  EXPECT_EQ(names(R"({"type":"Feature","id":"x","assets":{"d":{"href":"d.tif"}}})", "item"), Names{"d.tif"});
}

TEST_F(WrittenIn, AByteOrderMarkIsNoPartOfAList) {
  const std::string mark = "\xef\xbb\xbf";
  EXPECT_EQ(names(mark + R"({"sources":[{"path":"a.tif"}]})", "dem"), Names{"a.tif"});
  EXPECT_EQ(names(mark + "a.tif\n", "list.txt"), Names{"a.tif"});
  EXPECT_EQ(names(mark + "# all\na.tif\n", "list.lst"), Names{"a.tif"});
  EXPECT_EQ(names(mark + R"({"type":"Feature","id":"x","assets":{"d":{"href":"d.tif"}}})", "item"), Names{"d.tif"});
  EXPECT_EQ(
      names(
          mark +
              R"({"type":"FeatureCollection","features":[{"type":"Feature","geometry":null,"properties":{"location":"i.tif"}}]})",
          "index"),
      Names{"i.tif"});
  EXPECT_EQ(names(mark + "1 2 3\n", "points.txt"), Names());
}

/// Pictures of the heights may be GeoTIFFs, too.
TEST_F(WrittenIn, AThumbnailIsNotTheHeights) {
  const auto item = [](const std::string& assets) {
    return R"({"type":"Feature","id":"x","assets":{"thumb":{"href":"t.tif","roles":["thumbnail"]},)"
           R"("small":{"href":"o.tif","roles":["overview","visual"]},"meta":{"href":"m.tif","roles":["metadata"]})" +
           assets + "}}";
  };
  EXPECT_EQ(names(item(R"(,"dem":{"href":"d.tif","roles":["elevation"]})"), "i"), Names{"d.tif"});
  EXPECT_EQ(names(item(R"(,"dem":{"href":"d.tif"})"), "i"), Names{"d.tif"});
  EXPECT_EQ(names(item(R"(,"dem":{"href":"d","roles":["metadata","data"]})"), "i"), Names{"d"});
  EXPECT_EQ(names(item(""), "i"), Names{"sources-invalid"});
}

TEST_F(WrittenIn, WhatIsARasterNamesNone) {
  EXPECT_EQ(names("1 2 3\n2 2 3\n", "points.txt"), Names());
  EXPECT_EQ(names(R"({"type":"Collection"})", "c.json"), Names{"sources-invalid"});
  EXPECT_EQ(names("{", "c"), Names{"sources-invalid"});
}

}  // namespace
}  // namespace cordillera
