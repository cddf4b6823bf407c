// Lists of rasters: folders, texts, tile indices and STAC items.
#include "raster/mosaic/source_list.h"

#include <filesystem>
#include <fstream>

#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

class SourceList : public RasterTest {
 protected:
  std::vector<std::string> names(const std::string& word) {
    const auto listed = raster::list_sources(word);
    std::vector<std::string> names;
    if (!listed.ok()) return {listed.problem().type};
    for (const auto& source : *listed) names.push_back(std::filesystem::path(source.path).filename().string());
    return names;
  }
};

using Names = std::vector<std::string>;

TEST_F(SourceList, a_folder_is_its_rasters_by_name) {
  for (const char* name : {"b.tif", "a.TIF", "c.txt.tif"}) write(Spec{}, name);
  write_text("no raster", "readme.md");
  EXPECT_EQ(names(path("")), (Names{"a.TIF", "b.tif", "c.txt.tif"}));
}

TEST_F(SourceList, a_folder_has_what_its_links_lead_to) {
  namespace fs = std::filesystem;
  fs::create_directories(path("elsewhere/deep"));
  fs::create_directories(path("all/sub"));
  for (const char* name : {"all/a.tif", "all/sub/b.tif", "elsewhere/deep/c.tif", "elsewhere/d.tif"}) write(Spec{}, name);
  fs::create_symlink(path("elsewhere"), path("all/disk"));
  fs::create_symlink(path("elsewhere/d.tif"), path("all/e.tif"));
  fs::create_symlink(path("all"), path("all/sub/up"));  // no way round
  fs::create_symlink("sub", path("all/again"));
  fs::create_symlink("gone", path("all/readme.md"));
  fs::create_symlink("gone", path("all/.#a.tif"));  // an editor's lock
  EXPECT_EQ(names(path("all")), (Names{"a.tif", "d.tif", "c.tif", "e.tif", "b.tif"}));
  fs::create_symlink("gone.tif", path("all/f.tif"));
  EXPECT_EQ(names(path("all")), (Names{"a.tif", "d.tif", "c.tif", "e.tif", "f.tif", "b.tif"}))
      << "who opens it says that it is gone";
  fs::create_symlink("/nowhere/tiles", path("all/tiles"));
  const auto refused = raster::list_sources(path("all"));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().detail, path("all/tiles") + " is a link to what is not there");
}

TEST_F(SourceList, a_folder_tells_of_texts_that_look_like_points) {
  EXPECT_EQ(raster::note_on_texts(path("")), std::nullopt);
  write({}, "a.tif");
  write_text("Read me first.\n", "README.txt");
  write_text("a.tif vertical_datum=EGM2008\n", "list.txt");
  write_text(std::string("II*\0 1 2 3\n", 11), "raster.txt");
  EXPECT_EQ(raster::note_on_texts(path("")), std::nullopt);
  EXPECT_EQ(raster::note_on_texts(path("a.tif")), std::nullopt);
  EXPECT_EQ(raster::note_on_texts("/vsis3/bucket/"), std::nullopt);
  write_text("id,x,y,z\n1,2,3,4\n", "notes.csv");
  EXPECT_EQ(raster::note_on_texts(path("")),
            "notes.csv looks like points and was not taken with the folder; named by itself a text of points is a raster");
  write_text("0 1 5\n1 1 5\n0 0 5\n1 0 5\n", "DGM1.TXT");
  EXPECT_EQ(raster::note_on_texts(path("")).value_or("").find("2 texts, such as DGM1.TXT, look like points"), 0u);
  EXPECT_EQ(names(path("")), Names{"a.tif"}) << "and none of them is refused";
  std::filesystem::remove(path("a.tif"));
  const auto none = raster::list_sources(path(""));
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.problem().line().find("2 texts, such as DGM1.TXT, look like points"), std::string::npos);
  EXPECT_NE(none.problem().line().find("/*.txt"), std::string::npos);
}

TEST_F(SourceList, a_text_has_a_raster_a_line_with_its_own_options) {
  const auto listed = raster::list_sources(
      write_text("# fine first\n\"fine dem.tif\" vertical_datum=EGM2008 nodata=fill\n\n/abs/coarse.tif # all\n", "l.txt"));
  ASSERT_TRUE(listed.ok());
  ASSERT_EQ(listed->size(), 2u);
  EXPECT_EQ(listed->front().path, path("fine dem.tif"));
  ASSERT_EQ(listed->front().options.size(), 2u);
  EXPECT_EQ(listed->front().options[1].second, "fill");
  EXPECT_EQ(listed->back().path, "/abs/coarse.tif");
}

/// National models come as points in texts of any extension.
TEST_F(SourceList, a_text_of_points_is_a_raster) {
  for (const char* text : {"10.5 45.5 1\n10.6 45.5 2\n", "x;y;z\n10.5;45.5;1\n", "356000,5 5699000,5 90,1\n"}) {
    const std::string file = write_text(text, "points.txt");
    const auto listed = raster::list_sources(file);
    ASSERT_TRUE(listed.ok()) << listed.problem().line();
    ASSERT_EQ(listed->size(), 1u);
    EXPECT_EQ(listed->front().path, file);
  }
}

TEST_F(SourceList, a_raster_that_is_called_as_a_text_is_a_raster) {
  const std::string file = write(Spec{}, "dem.txt");
  const auto listed = raster::list_sources(file);
  ASSERT_TRUE(listed.ok()) << listed.problem().line();
  ASSERT_EQ(listed->size(), 1u);
  EXPECT_EQ(listed->front().path, file);
}

TEST_F(SourceList, stac_items_give_their_data_asset) {
  const std::string items = R"({"type":"FeatureCollection","features":[
    {"type":"Feature","id":"one","assets":{"thumb":{"href":"t.png","type":"image/png"},
     "dem":{"href":"one.tif","type":"image/tiff; application=geotiff"}}},
    {"type":"Feature","id":"two","assets":{"x":{"href":"other.tif"},"h":{"href":"s3://bucket/two.tif","roles":["data"]}}}]})";
  const auto listed = raster::list_sources(write_text(items, "items.json"));
  ASSERT_TRUE(listed.ok()) << listed.problem().line();
  ASSERT_EQ(listed->size(), 2u);
  EXPECT_EQ((*listed)[0].path, path("one.tif"));
  EXPECT_EQ((*listed)[1].path, "/vsis3/bucket/two.tif");
}

TEST_F(SourceList, references_with_escapes_are_files_of_this_machine) {
  for (const char* name : {"old sheet.tif", "a%20b.tif", "\xc3\xa9t\xc3\xa9.tif", "100%.tif"}) write(Spec{}, name);
  const auto named = [&](const std::string& href) {
    return names(
        write_text(R"({"type":"Feature","id":"x","assets":{"d":{"roles":["data"],"href":")" + href + R"("}}})", "i.json"));
  };
  EXPECT_EQ(named("./old%20sheet.tif"), Names{"old sheet.tif"});
  EXPECT_EQ(named("%C3%A9t%c3%a9.tif"), Names{"\xc3\xa9t\xc3\xa9.tif"});
  EXPECT_EQ(named("a%20b.tif"), Names{"a%20b.tif"}) << "a file of that very name comes first";
  EXPECT_EQ(named("100%.tif"), Names{"100%.tif"});
  EXPECT_EQ(named("100%25.tif"), Names{"100%.tif"});
  for (const char* missing : {"none%20there.tif", "old%20sheet.tif%00", "old%2", "old%zz"})
    EXPECT_EQ(named(missing), Names{missing});
}

/// What it held can be said of the raster alone, in the words that HTTP has for it.
TEST_F(SourceList, a_damaged_geopackage_is_told_as_a_raster) {
  const std::string zeros = write_text(std::string("SQLite format 3\0", 16) + std::string(500, '\0'), "zeros.gpkg");
  EXPECT_EQ(names(zeros), Names{"zeros.gpkg"});
  const auto refused = open(zeros);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "raster-unreadable");
  EXPECT_NE(refused.problem().detail.find("begins as a GeoPackage"), std::string::npos) << refused.problem().detail;
  Spec whole;
  whole.driver = "GPKG", whole.create = {"TILE_FORMAT=TIFF"};
  const std::string cut = write(whole, "cut.gpkg");
  EXPECT_EQ(names(cut), Names{"cut.gpkg"});
  std::filesystem::resize_file(cut, 5000);
  EXPECT_EQ(names(cut), Names{"cut.gpkg"});
}

// A server's page under the name of a list.
TEST_F(SourceList, a_page_is_told_as_one) {
  write_text("\n<!DOCTYPE html>\n<p class=x>not found</p>\n", "list.txt");
  const auto listed = raster::list_sources(path("list.txt"));
  ASSERT_FALSE(listed.ok());
  EXPECT_NE(listed.problem().detail.find("is a page or another XML text"), std::string::npos) << listed.problem().detail;
}

TEST_F(SourceList, a_list_that_is_none_is_refused) {
  EXPECT_EQ(names(path("missing.txt")), Names{"sources-invalid"});
  EXPECT_EQ(names(write_text("a.tif crs\n", "a.txt")), Names{"sources-invalid"});
  EXPECT_EQ(names(write_text("{", "a.json")), Names{"sources-invalid"});
  EXPECT_EQ(names(write_text("{}", "b.json")), Names{"sources-invalid"});
  EXPECT_EQ(names(write_text("# nothing\n", "c.txt")), Names{"sources-invalid"});
  write({}, "a.tif");
  EXPECT_EQ(names(write_text(R"({"sources": [{"path": "a.tif"}]})", "d.json")), Names{"a.tif"});
  EXPECT_EQ(names(write_text(R"({"sources": [{"path": "a.tif\u0000.x"}]})", "e.json")), Names{"sources-invalid"});
}
}  // namespace
}  // namespace cordillera::raster_test
