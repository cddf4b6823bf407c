// Lists of rasters, and VRTs, at an address: what they name is read by ranges, too.
#include <signal.h>

#include "live_address_fixture.h"

namespace cordillera::server {
namespace {

using Parts = RasterHost::Parts;

/// The hills, cut into four COGs beside each other.
class LiveMosaic : public ByRanges {
 protected:
  void SetUp() override {
    ByRanges::SetUp();
    fs::create_directories(folder_.path() / "parts");
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      parts_.push_back(part_of(k, 1000));
      host_.has_parts(address_of(k), parts_.back(), "\"one\"");
    }
    std::string sources, items;
    for (std::size_t k = 0; k < kNames.size(); ++k) {
      const Part part = place_of(k);
      const std::string size = std::to_string(part.columns), name = "parts/" + kNames[k];
      sources += "<SimpleSource><SourceFilename relativeToVRT=\"1\">" + name + "</SourceFilename><SourceBand>1</SourceBand>" +
                 "<SrcRect xOff=\"0\" yOff=\"0\" xSize=\"" + size + "\" ySize=\"" + size + "\"/><DstRect xOff=\"" +
                 std::to_string(part.column) + "\" yOff=\"" + std::to_string(part.row) + "\" xSize=\"" + size + "\" ySize=\"" +
                 size + "\"/></SimpleSource>";
      items += std::string(k == 0 ? "" : ",") + R"({"type":"Feature","id":")" + std::to_string(k) +
               R"(","assets":{"thumbnail":{"href":"t.png"},"dem":{"href":"./)" + name +
               R"(","type":"image/tiff; application=geotiff","roles":["data"]}}})";
    }
    std::ostringstream place;
    place.precision(17);
    place << kWest_deg << ", " << kPixel_deg << ", 0, " << kNorth_deg << ", 0, " << -kPixel_deg;
    vrt_ = "<VRTDataset rasterXSize=\"2048\" rasterYSize=\"2048\"><GeoTransform>" + place.str() +
           "</GeoTransform><VRTRasterBand dataType=\"Int16\" band=\"1\">" + sources + "</VRTRasterBand></VRTDataset>";
    items_ = R"({"type":"FeatureCollection","features":[)" + items + "]}";
  }
  static Part place_of(std::size_t k) {
    constexpr int kHalf = kSide / 2;
    return {static_cast<int>(k % 2) * kHalf, static_cast<int>(k / 2) * kHalf, kHalf, kHalf};
  }
  std::string part_of(std::size_t k, int height) const {
    return cog_of(height, place_of(k), (folder_.path() / "parts" / kNames[k]).string());
  }
  static std::string address_of(std::size_t k) { return "/dems/parts/" + kNames[k]; }
  std::uint64_t bytes_of_parts() const {
    std::uint64_t bytes = 0;
    for (const std::string& part : parts_) bytes += part.size();
    return bytes;
  }
  std::string sought(const std::string& target) const { return query(target, "&max_level=11"); }
  /// How a dataset of this list fails.
  Json failure(const std::string& target, const std::string& list) {
    host_.has(target, list);
    const Json answer = json("/v1/live" + query(target), "-H 'Prefer: wait=500'");
    EXPECT_EQ(answer.value("state", ""), "failed") << answer << server_.log();
    return answer.value("error", Json::object());
  }
  static std::string list_of(const std::string& path, const std::string& more = "") {
    return R"({"sources": [{"path": ")" + path + "\"" + more + "}]}";
  }
  static std::string vrt_of(const std::string& band, const std::string& sub_class = "") {
    return "<VRTDataset rasterXSize=\"64\" rasterYSize=\"64\"" + sub_class + ">" + band + "</VRTDataset>";
  }

  inline static const std::vector<std::string> kNames{"nw.tif", "ne.tif", "sw.tif", "se.tif"};
  std::vector<std::string> parts_;
  std::string vrt_, items_;
};

TEST_F(LiveMosaic, AVrtIsOneRasterWhosePartsAreReadByRanges) {
  host_.has_tagged("/dems/hills.vrt", vrt_, "\"vrt\"");
  start();
  const std::string one = tile_at(11.5, 46.6), other = tile_at(11, 46.2);
  const std::string id = id_of(sought("/dems/hills.vrt"));
  EXPECT_LT(host_.sent(), bytes_of_parts() / 2) << "provisional tiles are made of overviews";
  const std::string made = final_tile(id, one), copy = posted();
  EXPECT_FALSE(made.empty()) << server_.log();
  EXPECT_LT(host_.sent(), bytes_of_parts());
  EXPECT_EQ(final_tile(copy, one), made) << "the bytes of one raster with the same pixels";
  server_.end(SIGKILL);
  start();
  const auto before = host_.sent();
  EXPECT_EQ(final_tile(id, one), made);
  EXPECT_EQ(host_.sent(), before);
  EXPECT_EQ(final_tile(id, other), final_tile(copy, other)) << "it goes on where it was\n" << server_.log();
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched")));
}

TEST_F(LiveMosaic, StacItemsAreAMosaic) {
  host_.has_tagged("/dems/items?limit=10", items_, "\"items\"");
  start();
  const std::string tile = tile_at(11.25, 46.4);  // all four have a part of it
  const std::string id = id_of(sought("/dems/items?limit=10"));
  const std::string made = final_tile(id, tile);
  EXPECT_LT(host_.sent(), bytes_of_parts());
  std::ofstream(folder_.path() / "items.json") << items_;
  const std::string out = (folder_.path() / "built").string();
  ASSERT_EQ(shell(kProgram + " build " + (folder_.path() / "items.json").string() + " -o " + out +
                  " --crs EPSG:4326 --vertical-datum ellipsoid --error 20 --max-level 11")
                .code,
            0);
  EXPECT_EQ(file_text(out + tile), made) << "the bytes of a build of copies\n" << server_.log();
  const Json sources = json("/v1/datasets/" + id + "/manifest.json").value("sources", Json::array());
  ASSERT_EQ(sources.size(), kNames.size());
  EXPECT_EQ(sources[0].value("file", ""), "nw.tif");
  const std::string backup = (folder_.path() / "backup").string(), data = (folder_.path() / "data").string();
  ASSERT_EQ(shell(kProgram + " backup " + data + " -o " + backup).code, 0);
  server_.end(SIGTERM);
  fs::remove_all(data);
  ASSERT_EQ(shell(kProgram + " restore " + backup + " --data " + data).code, 0);
  start();
  EXPECT_EQ(status(id)["asleep"], true) << "a backup has no rasters of a list";
  EXPECT_EQ(final_tile(id, tile), made) << server_.log();
}

TEST_F(LiveMosaic, ATileIndexIsAMosaicToo) {
  std::string features;
  for (const std::string& name : kNames)
    features += std::string(features.empty() ? "" : ",") +
                R"({"type":"Feature","geometry":null,"properties":{"location":"/vsicurl/)" + host_.address() + "/dems/parts/" +
                name + R"("}})";
  host_.has_tagged("/dems/index.geojson", R"({"type":"FeatureCollection","features":[)" + features + "]}", "\"index\"");
  host_.has_tagged("/dems/items", items_, "\"items\"");
  start();
  const std::string tile = tile_at(11.25, 46.4);
  EXPECT_EQ(final_tile(id_of(sought("/dems/index.geojson")), tile), final_tile(id_of(sought("/dems/items")), tile))
      << server_.log();
}

TEST_F(LiveMosaic, RastersOfAHostWithoutRangesAreCopied) {
  host_.has_tagged("/dems/cone.asc", cone_of(2500), "\"cone\"");
  host_.has_tagged("/dems/list.json", list_of("cone.asc", R"(, "z_offset": 1000)"), "\"list\"");
  start();
  EXPECT_NEAR(top(query("/dems/list.json")), 3500, 60) << "with the options of its list\n" << server_.log();
}

TEST_F(LiveMosaic, OneThatChangesMeansANewVersion) {
  host_.has_tagged("/dems/hills.vrt", vrt_, "\"vrt\"");
  start({"--live-fresh", "0"});
  const std::string id = id_of(sought("/dems/hills.vrt"));
  const auto height = [&] {
    Json answer = json("/v1/datasets/" + id + "/elevation?points=11.5,46.2");
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number()
               ? answer["points"][0]["ellipsoidal_height"].get<double>()
               : 0;
  };
  EXPECT_NEAR(height(), 1000, 300);
  host_.has_parts(address_of(3), part_of(3, 3000), "\"two\"");
  EXPECT_TRUE(eventually([&] { return height() > 2500; })) << "who reads it has its rasters asked for again\n" << server_.log();
}

/// Also when all of it has been built, and its rasters are there no longer.
TEST_F(LiveMosaic, OneOfAFinishedDatasetThatChangesMeansANewVersion) {
  host_.has_tagged("/dems/cone.asc", cone_of(2500), "\"cone\"");
  host_.has_tagged("/dems/list.json", list_of("cone.asc"), "\"list\"");
  start({"--live-fresh", "0"});
  const std::string cone = query("/dems/list.json"), id = id_of(cone);
  ASSERT_TRUE(eventually([&] { return top(cone) > 0 && status(id)["state"] == "ready"; })) << server_.log();
  host_.has_tagged("/dems/cone.asc", cone_of(4000), "\"other\"");
  EXPECT_TRUE(eventually([&] { return std::abs(top(cone) - 4000) < 60; })) << server_.log();
}

TEST_F(LiveMosaic, AListThatCannotBeBuiltTakesNothingAway) {
  host_.has_tagged("/dems/hills.vrt", vrt_, "\"vrt\"");
  start({"--live-fresh", "0"});
  const std::string id = id_of(query("/dems/hills.vrt", "&max_level=9"));
  const auto height = [&] {
    Json answer = json("/v1/datasets/" + id + "/elevation?points=11.5,46.2");
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number()
               ? answer["points"][0]["ellipsoidal_height"].get<double>()
               : 0;
  };
  const auto stays = [&] {
    const std::string log = server_.log(), said = "what was built stays";
    int count = 0;
    for (auto at = log.find(said); at != std::string::npos; at = log.find(said, at + 1)) ++count;
    return count;
  };
  ASSERT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  host_.has_parts(address_of(3), parts_[3].substr(0, parts_[3].size() / 2), "\"half\"");
  ASSERT_TRUE(eventually([&] { return height() > 0 && stays() > 0; })) << "a raster of it\n" << server_.log();
  host_.has_parts(address_of(3), parts_[3], "\"one\"");
  host_.has_tagged("/dems/hills.vrt", vrt_.substr(0, vrt_.size() / 2), "\"half\"");
  const int before = stays();
  ASSERT_TRUE(eventually([&] { return height() > 0 && stays() > before + 1; })) << "the list itself\n" << server_.log();
  EXPECT_EQ(status(id)["state"], "ready");
  EXPECT_NEAR(height(), 1000, 300);
  host_.has_parts(address_of(3), part_of(3, 3000), "\"two\"");
  host_.has_tagged("/dems/hills.vrt", vrt_, "\"mended\"");
  EXPECT_TRUE(eventually([&] { return height() > 2500; })) << server_.log();
}

/// GDAL would open it with any driver, and read what it names.
TEST_F(LiveMosaic, AVrtNamesNoOtherVrt) {
  const std::string inner =
      "<VRTDataset rasterXSize=\"64\" rasterYSize=\"64\"><GeoTransform>10, 0.01, 0, 47, 0, -0.01</GeoTransform>"
      "<VRTRasterBand dataType=\"Byte\" band=\"1\" subClass=\"VRTRawRasterBand\"><SourceFilename "
      "relativeToVRT=\"0\">/usr/bin/env</SourceFilename><ImageOffset>0</ImageOffset></VRTRasterBand></VRTDataset>";
  const std::string outer =
      "<VRTDataset rasterXSize=\"64\" rasterYSize=\"64\"><GeoTransform>10, 0.01, 0, 47, 0, -0.01</GeoTransform>"
      "<VRTRasterBand dataType=\"Byte\" band=\"1\"><SimpleSource><SourceFilename relativeToVRT=\"1\">inner.in"
      "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>";
  start();
  for (const std::string before : {"", "  \n", "<!-- x -->"}) {
    host_.has_tagged("/dems/inner.in", before + inner, "\"in\"");
    const Json problem = failure("/dems/" + std::to_string(before.size()) + ".vrt", outer);
    EXPECT_THAT(problem.dump(), HasSubstr("names another VRT, inner.in, and a VRT in a VRT is not read"));
  }
}

/// What is there of a raster in parts is nothing without its map.
TEST_F(LiveMosaic, ARasterWhoseMapIsGoneIsFetchedAgain) {
  host_.has_tagged("/dems/items", items_, "\"items\"");
  start();
  const std::string id = id_of(sought("/dems/items")), tile = tile_at(11.25, 46.4), made = final_tile(id, tile);
  server_.end(SIGKILL);
  for (const char* store : {"dataset.sqlite", "provisional.sqlite"}) fs::remove(folder_of(id) / store);
  ASSERT_TRUE(fs::remove(folder_of(id) / kRasters / "0.tif.blocks"));
  start();
  EXPECT_EQ(final_tile(id, tile), made) << server_.log();
  EXPECT_THAT(server_.log(), HasSubstr("is fetched"));
}

TEST_F(LiveMosaic, WhatAListMayNotNameIsSaid) {
  start();
  const auto before = host_.asked().size();
  const auto of = [](const Json& problem) { return problem.value("type", "").substr(problem.value("type", "").rfind(':') + 1); };
  EXPECT_EQ(of(failure("/dems/a", list_of("../private/cone.tif"))), "option-forbidden");
  EXPECT_EQ(of(failure("/dems/b", list_of("http://127.0.0.1:1/cone.tif"))), "option-forbidden");
  EXPECT_EQ(of(failure("/dems/c", list_of("/vsicurl/file:///etc/passwd"))), "option-forbidden");
  EXPECT_EQ(of(failure("/dems/d", list_of("hills.tif", R"(, "vertical_datum": "/etc/grid.gtx")"))), "option-forbidden");
  EXPECT_EQ(of(failure("/dems/e", list_of("hills.tif", R"(, "error": 3)"))), "option-unknown");
  EXPECT_EQ(of(failure("/dems/f", R"({"type": "Collection"})")), "sources-invalid");
  const std::string
      raw = vrt_of("<VRTRasterBand subClass=\"VRTRawRasterBand\"><SourceFilename>/etc/passwd</SourceFilename></VRTRasterBand>"),
      local = vrt_of("<VRTRasterBand><SimpleSource><SourceFilename>/etc/passwd</SourceFilename></SimpleSource></VRTRasterBand>"),
      computed =
          vrt_of("<VRTRasterBand subClass=\"VRTDerivedRasterBand\"><PixelFunctionType>sqrt</PixelFunctionType></VRTRasterBand>");
  for (const std::string& vrt : {raw, local, computed})
    EXPECT_EQ(of(failure("/dems/" + std::to_string(vrt.size()) + ".vrt", vrt)), "raster-format-unsupported");
  EXPECT_EQ(host_.asked().size(), before + 9) << "the lists were asked for, and nothing that they name";
  const Json missing = failure("/dems/g", list_of("none.tif"));
  EXPECT_EQ(of(missing), "source-unreachable");
  EXPECT_THAT(missing.dump(), HasSubstr("none.tif"));
}

/// With build=full a raster is copied and kept, and a list is none.
TEST_F(LiveMosaic, AListIsReadLazily) {
  host_.has_tagged("/dems/items", items_, "\"items\"");
  start();
  const auto post = [&](const std::string& options) {
    return curl("-H 'Prefer: wait=500' -d source=" + host_.address() +
                "/dems/items -d crs=EPSG:4326 -d vertical_datum=ellipsoid -d max_level=11" + options + " '" + server_.base() +
                "/v1/datasets'");
  };
  EXPECT_THAT(post(" -d build=full").dump(), AllOf(HasSubstr("raster-format-unsupported"), HasSubstr("build=lazy")));
  const Json lazy = post("");
  EXPECT_EQ(lazy.value("build", ""), "lazy") << lazy;
  EXPECT_FALSE(final_tile(lazy.value("id", ""), tile_at(11.25, 46.4)).empty()) << lazy;
}

/// One build at a time: what has an address is looked at while it waits for its turn, too.
TEST_F(LiveMosaic, AnAddressIsShownWhileItWaits) {
  host_.has_tagged("/dems/items", items_, "\"items\"");
  start({"--jobs", "1"});
  const std::string held =
      json("/v1/datasets?name=hills.tif&crs=EPSG:4326&vertical_datum=ellipsoid&error=1&threads=1", "--data-binary @" + raster_)
          .value("id", "");
  ASSERT_TRUE(eventually([&] { return status(held)["provisional"] == true; })) << server_.log();
  const int job = server_.child_process();
  ASSERT_EQ(kill(job, SIGSTOP), 0);
  const std::string items = id_of(sought("/dems/items")), hills = id_of(sought(kCog));
  for (const std::string& id : {items, hills}) {
    const Json waits = status(id);
    EXPECT_EQ(waits.value("state", ""), "queued") << waits;
    EXPECT_EQ(waits.value("provisional", false), true) << waits;
    EXPECT_THAT(body("/v1/datasets/" + id + "/tileset.json"), HasSubstr("geometricError"));
  }
  EXPECT_EQ(status(held)["state"], "running") << "or nothing has waited";
  EXPECT_EQ(kill(job, SIGCONT), 0);
  shell("curl -q -s -X DELETE '" + server_.base() + "/v1/datasets/" + held + "'");
  EXPECT_FALSE(final_tile(items, tile_at(11.25, 46.4)).empty()) << server_.log();
  EXPECT_FALSE(final_tile(hills, tile_at(11.25, 46.4)).empty());
}

}  // namespace
}  // namespace cordillera::server
