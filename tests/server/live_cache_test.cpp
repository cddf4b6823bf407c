// What goes when datasets of addresses, and blocks that were looked at, take more room than they may.
#include "live_address_fixture.h"

namespace cordillera::server {
namespace {

/// Rasters that are larger than what may be kept.
class CacheLimit : public LiveAddress {
 protected:
  void SetUp() override {
    constexpr int kSide = 640;
    std::ostringstream text;
    text << "ncols " << kSide << "\nnrows " << kSide << "\nxllcorner 10\nyllcorner 46\ncellsize 0.0005\n";
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column)
        text << static_cast<int>(1000 + 300 * std::sin(column / 9.0) * std::cos(row / 7.0)) << ' ';
      text << '\n';
    }
    for (const char* name : {"/dems/a.asc", "/dems/b.asc"}) host_.has_tagged(name, text.str(), "\"one\"");
    raster_ = (folder_.path() / "hills.asc").string();
    std::ofstream(raster_) << text.str();
  }
  /// Its blocks are made one by one.
  std::string lazy(const std::string& target) const { return query(target, "&max_level=13"); }
  static constexpr const char* kFinal = "-H 'Prefer: wait=500'";
  bool falls_asleep(const std::string& id) {
    return eventually([&] { return status(id)["asleep"] == true; });
  }
  /// Of the finest level, in the middle.
  std::string tile() const {
    const double tiles = std::ldexp(1, 13) / 180;
    return "/tiles/13/" + std::to_string(static_cast<int>(190.15 * tiles)) + "/" +
           std::to_string(static_cast<int>(136.15 * tiles)) + ".drc";
  }
};

TEST_F(CacheLimit, WhatWasReadLongestAgoGoesAndComesAgain) {
  start({"--cache-limit", "1"});
  const std::string a = id_of(lazy("/dems/a.asc"));
  const std::string made = body("/v1/live" + tile() + lazy("/dems/a.asc"), kFinal);
  EXPECT_FALSE(made.empty());
  ASSERT_TRUE(falls_asleep(a)) << server_.log();
  EXPECT_TRUE(eventually([&] { return body("/metrics").find("cordillera_live_bytes 0\n") != std::string::npos; }));
  for (const auto& entry : fs::directory_iterator(folder_of(a)))
    EXPECT_THAT(entry.path().extension().string(), ".json") << entry.path();
  EXPECT_EQ(status(a)["state"], "running");
  EXPECT_THAT(body("/metrics"), HasSubstr("cordillera_live_forgotten_total{kind=\"address\"} 1"));
  EXPECT_EQ(json("/v1/limits")["limits"]["cache_limit"]["value"], 1);
  server_.end(SIGKILL);
  start({"--cache-limit", "1"});
  EXPECT_EQ(status(a)["asleep"], true) << "a start wakes nobody";
  EXPECT_EQ(asked("/dems/a.asc"), 1);
  EXPECT_EQ(body("/v1/datasets/" + a + tile(), kFinal), made)
      << "whoever reads it has it fetched and made again, with the same bytes\n"
      << server_.log();
  EXPECT_EQ(asked("/dems/a.asc"), 2);
  const std::string b = id_of(lazy("/dems/b.asc"));
  EXPECT_TRUE(falls_asleep(a));
  EXPECT_TRUE(falls_asleep(b));
}

TEST_F(CacheLimit, MeshesOfItsTilesCount) {
  start();
  const std::string a = id_of(lazy("/dems/a.asc"));
  EXPECT_FALSE(body("/v1/live" + tile() + lazy("/dems/a.asc"), kFinal).empty());
  const auto bytes_of_meshes = [&] {
    std::uintmax_t bytes = 0;
    std::error_code none_yet;
    for (const auto& entry : fs::recursive_directory_iterator(folder_of(a) / "dataset.sqlite-meshes", none_yet))
      if (entry.is_regular_file()) bytes += entry.file_size();
    return bytes;
  };
  const auto counted = [&] {
    const std::string all = body("/metrics"), name = "\ncordillera_live_bytes ";
    return std::stoull(all.substr(all.find(name) + name.size()));
  };
  ASSERT_TRUE(eventually([&] { return bytes_of_meshes() > 0; })) << "the tile comes before its block is committed";
  const auto others = [&] {
    std::uintmax_t bytes = 0;
    for (const auto& entry : fs::directory_iterator(folder_of(a)))
      if (entry.is_regular_file() && entry.path().extension() != ".json") bytes += entry.file_size();
    return bytes;
  };
  EXPECT_TRUE(eventually([&] { return counted() > others() + bytes_of_meshes() / 2; })) << counted();
}

TEST_F(CacheLimit, BlocksOfAPostedLazyDatasetGoAndItsRasterStays) {
  start({"--cache-limit", "1"});
  const std::string full = curl("--data-binary @" + raster_ + " '" + server_.base() +
                                "/v1/datasets?name=hills.asc&crs=EPSG:4326&error=200&max_level=9'")
                               .value("id", "");
  const std::string id =
      curl("--data-binary @" + raster_ + " -H 'Prefer: wait=500' '" + server_.base() +
           "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=0.3&build=lazy&max_level=13'")
          .value("id", "");
  const std::string made = body("/v1/datasets/" + id + tile(), kFinal);
  EXPECT_FALSE(made.empty());
  // It is more than the one MiB that may be kept.
  ASSERT_TRUE(falls_asleep(id)) << status(id);
  EXPECT_TRUE(fs::exists(folder_of(id) / "source.asc"));
  for (const char* gone : {"dataset.sqlite", "provisional.sqlite"})
    EXPECT_TRUE(eventually([&] { return !fs::exists(folder_of(id) / gone); })) << gone;
  EXPECT_EQ(status(id)["build"], "lazy");
  EXPECT_EQ(body("/v1/datasets/" + id + tile(), kFinal), made) << server_.log();
  ASSERT_TRUE(falls_asleep(id));
  EXPECT_EQ(curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=full'").value("id", ""), id);
  EXPECT_EQ(status(id)["asleep"], false);
  EXPECT_EQ(status(id)["build"], "full");
  EXPECT_EQ(body("/v1/datasets/" + id + tile(), kFinal), made) << "all of it is made";
  EXPECT_TRUE(eventually([&] { return status(full)["state"] == "ready"; })) << "what was built in full stays";
}

}  // namespace
}  // namespace cordillera::server
