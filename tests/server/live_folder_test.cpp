// serve --live with the real program: rasters that come, change and go.
#include <gmock/gmock.h>

#include <unistd.h>

#include <fstream>

#include "program_fixture.h"
#include "server/live/side_files.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class LiveFolder : public Program {
 protected:
  LiveFolder() { fs::create_directories(live_ / "alps"); }
  void start(const std::vector<std::string>& more = {}) {
    std::vector<std::string> options = {"--live", live_.string(), "--crs", "EPSG:4326", "--vertical-datum", "ellipsoid"};
    options.insert(options.end(), more.begin(), more.end());
    server_.start(folder_.path(), options);
  }
  bool is_logged(const std::string& text) {
    return eventually([&] { return server_.log().find(text) != std::string::npos; });
  }
  /// A slope, `rise` metres a column. It appears under its name at once, as `mv` makes it.
  void put(const std::string& name, int rise) {
    const fs::path beside = folder_.path() / "beside.asc";
    {
      std::ofstream file(beside);
      file << "ncols 60\nnrows 50\nxllcorner 10\nyllcorner 46\ncellsize 0.001\nNODATA_value -9999\n";
      for (int row = 0; row < 50; ++row) {
        for (int column = 0; column < 60; ++column) file << 100 + rise * column << ' ';
        file << '\n';
      }
    }
    fs::rename(beside, live_ / name);
  }
  /// "id state" of all that are listed.
  std::vector<std::string> listed() {
    std::vector<std::string> all;
    const Json list = curl(server_.base() + "/v1/datasets");
    for (const Json& one : list["datasets"]) all.push_back(std::string(one["id"]) + " " + std::string(one["state"]));
    std::sort(all.begin(), all.end());
    return all;
  }
  bool becomes(const std::vector<std::string>& wanted) {
    return eventually([&] { return listed() == wanted; }) || (ADD_FAILURE() << testing::PrintToString(listed()) << "\n"
                                                                            << server_.log(),
                                                              false);
  }
  double highest(const std::string& id) {
    Json manifest = curl(server_.base() + "/v1/datasets/" + id + "/manifest.json");
    return manifest["bounds"].is_array() ? double(manifest["bounds"][5]) : -1;
  }

  fs::path live_ = folder_.path() / "rasters";
};

TEST_F(LiveFolder, RastersComeChangeAndGo) {
  put("north.asc", 1);
  put("alps/south.asc", 2);
  std::ofstream(live_ / "notes.txt") << "no raster";
  std::ofstream(live_ / "north.prj").flush();  // says nothing
  std::ofstream(live_ / ".hidden.asc") << "nor this";
  start();
  ASSERT_TRUE(becomes({"alps-south ready", "north ready"}));
  const double before = highest("north");
  put("north.asc", 3);
  EXPECT_TRUE(eventually([&] { return highest("north") > before + 100; })) << server_.log();
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/north/sources")["version"], 2) << "a version of the same dataset";
  fs::remove(live_ / "alps/south.asc");
  ASSERT_TRUE(becomes({"north ready"}));
}

TEST_F(LiveFolder, WhatChangesWhileTheServiceIsDownIsFound) {
  put("stays.asc", 1);
  put("goes.asc", 1);
  start();
  ASSERT_TRUE(becomes({"goes ready", "stays ready"}));
  server_.end(SIGTERM);
  fs::remove(live_ / "goes.asc");
  put("comes.asc", 1);
  start();
  ASSERT_TRUE(becomes({"comes ready", "stays ready"}));
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/stays/sources")["version"], 1) << "nothing was built twice";
}

TEST_F(LiveFolder, WhatIsDeletedOverHttpStaysAwayUntilItChanges) {
  put("one.asc", 1);
  put("two.asc", 1);
  start();
  ASSERT_TRUE(becomes({"one ready", "two ready"}));
  shell("curl -q -s -X DELETE " + server_.base() + "/v1/datasets/one");
  put("three.asc", 1);  // when it is there, the folder has been looked at
  ASSERT_TRUE(becomes({"three ready", "two ready"}));
  put("one.asc", 2);
  ASSERT_TRUE(becomes({"one ready", "three ready", "two ready"}));
}

TEST_F(LiveFolder, WhatCannotBeBuiltIsToldAndTriedAgainWhenItChanges) {
  std::ofstream(live_ / "bad.tif") << "no TIFF at all";
  start();
  ASSERT_TRUE(becomes({"bad failed"}));
  EXPECT_THAT(server_.log(), HasSubstr("bad.tif"));
  put("bad.tif", 1);  // an ASCII grid by another name
  ASSERT_TRUE(becomes({"bad ready"}));
  std::ofstream(live_ / "bad.tif") << "no TIFF again";
  EXPECT_TRUE(is_logged("warning dataset bad: version 2 failed: bad.tif")) << server_.log();
  EXPECT_EQ(listed(), std::vector<std::string>{"bad ready"}) << "the version before is served";
}

TEST_F(LiveFolder, AFileThatMayNotBeReadIsToldAndTriedAgain) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read every file";
  put("one.asc", 1);
  fs::permissions(live_ / "one.asc", fs::perms::none);
  start();
  EXPECT_TRUE(is_logged("live folder: one.asc may not be read by this service; tried again")) << server_.log();
  fs::permissions(live_ / "one.asc", fs::perms::owner_all);
  EXPECT_TRUE(becomes({"one ready"}));
}

TEST_F(LiveFolder, WhatLiesBesideARasterIsReadWithIt) {
  const auto write = [](const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; };
  const std::string utm =
      R"(PROJCS["UTM 32N",GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],)"
      R"(UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["latitude_of_origin",0],)"
      R"(PARAMETER["central_meridian",9],PARAMETER["scale_factor",0.9996],PARAMETER["false_easting",500000],)"
      R"(PARAMETER["false_northing",0],UNIT["metre",1]])";
  const auto heights = [](float metres) {
    const std::vector<float> all(40 * 40, metres);
    return std::string(reinterpret_cast<const char*>(all.data()), all.size() * sizeof(float));
  };
  const std::string place = "ncols 40\nnrows 40\nxllcorner 500000\nyllcorner 5000000\ncellsize 30\n";
  write(live_ / "flat.hdr", place + "byteorder LSBFIRST\n");
  write(live_ / "flat.prj", utm);
  write(live_ / "flat.flt", heights(100));
  write(live_ / "alone.flt", heights(100));
  write(live_ / "alone.prj", utm);
  write(live_ / "alone.flt.aux.xml", "<PAMDataset/>\n");
  server_.start(folder_.path(), {"--live", live_.string(), "--vertical-datum", "ellipsoid"});
  ASSERT_TRUE(becomes({"flat ready"})) << "one without its header is none";
  EXPECT_NEAR(highest("flat"), 100, 1);
  write(live_ / "flat.flt", heights(300));
  EXPECT_TRUE(eventually([&] { return highest("flat") > 299; })) << server_.log();
  write(live_ / "flat.hdr", place + "nodata_value 300\nbyteorder LSBFIRST\n");
  const auto sources = [&] { return curl(server_.base() + "/v1/datasets/flat/sources").dump(); };
  EXPECT_TRUE(eventually([&] { return sources().find("raster-all-nodata") != std::string::npos; })) << sources();
}

TEST_F(LiveFolder, AFileThatBecomesEmptyChangesNothing) {
  put("one.asc", 1);
  start();
  ASSERT_TRUE(becomes({"one ready"}));
  std::ofstream(live_ / "one.asc").flush();
  EXPECT_TRUE(is_logged("one.asc: the file is empty"));
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/one/sources")["version"], 1);
  EXPECT_EQ(listed(), std::vector<std::string>{"one ready"});
}

TEST_F(LiveFolder, WhatALimitKeepsOutComesWhenThereIsRoom) {
  put("one.asc", 1);
  start({"--max-datasets", "1"});
  ASSERT_TRUE(becomes({"one ready"}));
  put("two.asc", 1);
  EXPECT_TRUE(is_logged("two.asc: this service holds as many datasets as it may; accepted:")) << server_.log();
  fs::remove(live_ / "one.asc");
  ASSERT_TRUE(becomes({"two ready"}));
}

TEST_F(LiveFolder, AFolderThatMayNotBeReadIsPassedOver) {
  if (geteuid() == 0) GTEST_SKIP() << "root may read every folder";
  fs::create_directories(live_ / "lost+found");
  put("one.asc", 1);
  put("alps/two.asc", 1);
  put("zoo.asc", 1);
  fs::permissions(live_ / "lost+found", fs::perms::none);
  start();
  ASSERT_TRUE(becomes({"alps-two ready", "one ready", "zoo ready"}));
  EXPECT_TRUE(is_logged("lost+found/ may not be read"));
  fs::permissions(live_ / "alps", fs::perms::none);
  fs::remove(live_ / "one.asc");
  EXPECT_TRUE(becomes({"alps-two ready", "zoo ready"})) << "what was in a folder that is closed now stays";
  for (const char* closed : {"alps", "lost+found"}) fs::permissions(live_ / closed, fs::perms::owner_all);
}

// A disk that is not mounted looks like this.
TEST_F(LiveFolder, AnEmptyFolderDeletesNothing) {
  put("one.asc", 1);
  start();
  ASSERT_TRUE(becomes({"one ready"}));
  const fs::path away = folder_.path() / "away";
  fs::rename(live_, away);
  fs::create_directory(live_);
  EXPECT_TRUE(is_logged("nothing is deleted"));
  fs::remove(live_);
  fs::rename(away, live_);
  put("two.asc", 1);  // when it is there, the folder has been looked at again
  ASSERT_TRUE(becomes({"one ready", "two ready"}));
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/one/sources")["version"], 1);
}

TEST_F(LiveFolder, ARasterThatWasAddedOverHttpStaysWhenTheFileChanges) {
  put("one.asc", 1);
  start();
  ASSERT_TRUE(becomes({"one ready"}));
  const std::string at = server_.base() + "/v1/datasets/one/sources";
  const std::string own = curl(at)["sources"][0]["id"];
  const std::string options = "?name=one.asc&position=0&crs=EPSG:4326&vertical_datum=ellipsoid";
  Json added = curl("-H 'Prefer: wait=400' --data-binary @" + raster_ + " '" + at + options + "'");
  ASSERT_EQ(added["state"], "done") << added.dump();
  ASSERT_EQ(curl(at)["sources"][0]["id"], added["source"]);
  put("one.asc", 3);
  EXPECT_TRUE(eventually([&] { return curl(at)["version"] == 3; })) << server_.log();
  Json sources = curl(at)["sources"];
  EXPECT_EQ(sources[0]["bytes"], fs::file_size(raster_));
  EXPECT_EQ(sources[1]["id"], own);
  EXPECT_EQ(sources[1]["bytes"], fs::file_size(live_ / "one.asc"));
  shell("curl -q -s -X DELETE -H 'Prefer: wait=400' " + at + "/" + own);
  put("one.asc", 4);
  EXPECT_TRUE(is_logged("is known to have come of this file")) << server_.log();
  EXPECT_EQ(curl(at)["sources"].size(), 1u);
}

TEST_F(LiveFolder, AnotherFolderIsRefusedAndDeletesNothing) {
  put("one.asc", 1);
  start();
  ASSERT_TRUE(becomes({"one ready"}));
  server_.end(SIGTERM);
  const fs::path other = folder_.path() / "other", notes = folder_.path() / "data/live.json";
  fs::create_directory(other);
  fs::copy_file(raster_, other / "two.asc");
  const std::string serve = kProgram + " serve --listen 127.0.0.1:0 --data " + (folder_.path() / "data").string() + " --live ";
  const Ended refused = shell("timeout 60 " + serve + other.string());
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, HasSubstr("tells of the rasters in " + live_.string()));
  EXPECT_THAT(refused.output, HasSubstr("accepted: --live " + live_.string()));
  const std::string before = file_text(notes);
  for (const std::string text :
       {R"({"f1.tif":{"dataset":5}})", R"({"f1.tif":5})", "[]", "", R"({"f1.tif":{"dataset":"a","bytes":-1}})"}) {
    std::ofstream(notes) << text;
    const Ended damaged = shell("timeout 60 " + serve + live_.string());
    EXPECT_EQ(damaged.code, 1) << text;
    EXPECT_THAT(damaged.output, HasSubstr("live.json is no list")) << text;
    EXPECT_EQ(file_text(notes), text);
  }
  fs::rename(live_, folder_.path() / "moved");
  live_ = folder_.path() / "moved";
  std::string moved = before;
  moved.replace(moved.find("rasters"), 7, "moved");
  std::ofstream(notes) << moved;
  start();
  ASSERT_TRUE(becomes({"one ready"}));
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/one/sources")["version"], 1);
}

TEST_F(LiveFolder, NotesWithoutAFolderAndWithoutIdsGoOn) {
  put("one.asc", 1);
  start();
  ASSERT_TRUE(becomes({"one ready"}));
  server_.end(SIGTERM);
  const fs::path notes = folder_.path() / "data/live.json";
  auto old = nlohmann::json::parse(file_text(notes));
  old.erase("folder");
  old["one.asc"].erase("source");
  std::ofstream(notes) << old.dump();
  std::ofstream(live_ / "two.zip") << "not looked into";
  start();
  EXPECT_TRUE(eventually([&] { return nlohmann::json::parse(file_text(notes)).value("folder", "") == live_.string(); }));
  put("one.asc", 2);
  EXPECT_TRUE(eventually([&] { return curl(server_.base() + "/v1/datasets/one/sources")["version"] == 2; })) << server_.log();
  EXPECT_EQ(listed(), std::vector<std::string>{"one ready"});
  EXPECT_TRUE(is_logged("two.zip is passed over"));
}

TEST(SideFiles, AreFoundByTheNameOfTheirRaster) {
  SideFiles files;
  for (const char* path : {"a/dem.tfw", "a/DEM.prj", "b/dem.prj", "a/dem.tif.aux.xml", "a/tile.01.prj", "a/tile.02.prj",
                           "a/grid.asc.aux.xml", "a/grid.aux.xml", "a/dem.txt"})
    files.add(path, {1, 1});
  const auto of = [&](const std::string& raster) {
    std::vector<std::string> paths;
    for (const auto& side : files.of(raster)) paths.push_back(side.path);
    return paths;
  };
  EXPECT_THAT(of("a/dem.tif"), testing::ElementsAre("a/DEM.prj", "a/dem.tfw")) << "no notes on a TIFF";
  EXPECT_THAT(of("b/DEM.TIF"), testing::ElementsAre("b/dem.prj"));
  EXPECT_THAT(of("a/tile.02.tif"), testing::ElementsAre("a/tile.02.prj"));
  EXPECT_THAT(of("a/grid.asc"), testing::ElementsAre("a/grid.asc.aux.xml", "a/grid.aux.xml"));
  EXPECT_THAT(of("a/other.asc"), testing::IsEmpty());
  const auto print = [](std::int64_t of_raster, std::int64_t of_side) {
    FilePrint both{100, of_raster};
    both.add({10, of_side});
    return both;
  };
  EXPECT_NE(print(5, 9), print(7, 9)) << "an older raster beside a newer side is another one";
  EXPECT_NE(print(5, 9), print(9, 5));
  EXPECT_EQ(print(-5'000'000'000'000'000'000, -4'900'000'000'000'000'000),
            print(-5'000'000'000'000'000'000, -4'900'000'000'000'000'000));
}

TEST_F(LiveFolder, FoldersThatLieInEachOtherAreRefused) {
  const auto run = [&](const std::string& live) {
    return shell(kProgram + " serve --data " + (live_ / "data").string() + " --live " + live + " 2>&1").output;
  };
  EXPECT_THAT(run(live_.string()), HasSubstr("lie in each other"));
  EXPECT_THAT(run((folder_.path() / "none").string()), HasSubstr("is no folder"));
}

}  // namespace
}  // namespace cordillera::server
