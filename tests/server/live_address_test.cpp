// /v1/live?url=…: datasets of what stands at an address, without a POST, and what goes when they take more room than they may.
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "program_fixture.h"
#include "raster_host.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A cone whose top is so high, in metres.
std::string cone_of(int top) {
  std::ostringstream text;
  text << "ncols 64\nnrows 64\nxllcorner 10\nyllcorner 46\ncellsize 0.0083333333333333\nNODATA_value -9999\n";
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column) text << top - 10 * std::hypot(row - 31.5, column - 31.5) << ' ';
    text << '\n';
  }
  return text.str();
}

class LiveAddress : public Program {
 protected:
  void SetUp() override {
    host_.has_tagged("/dems/cone.asc", cone_of(2000), "\"one\"");
    host_.has_tagged("/dems/signed.asc?sig=secret", cone_of(1000), "\"signed\"");
  }
  void start(std::vector<std::string> more = {}, const std::string& allowed = "/dems/") {
    more.insert(more.begin(), {"--source-allow", host_.address() + allowed, "--max-wait", "600"});
    server_.start(folder_.path(), more);
  }
  /// The query of a raster on the host.
  std::string query(const std::string& target, const std::string& options = "") const {
    std::string escaped;
    for (const char c : host_.address() + target)
      escaped += c == '?' ? "%3F" : c == '=' ? "%3D" : c == '&' ? "%26" : std::string(1, c);
    return "?url=" + escaped + "&crs=EPSG:4326&vertical_datum=ellipsoid&error=20" + options;
  }
  /// The whole answer, its head first.
  std::string whole(const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -i -m 500 " + more + " '" + server_.base() + path + "'").output;
  }
  std::string body(const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -m 500 " + more + " '" + server_.base() + path + "'").output;
  }
  Json json(const std::string& path, const std::string& more = "") { return Json::parse(body(path, more), nullptr, false); }
  std::string slug(const std::string& path, const std::string& more = "") {
    Json answer = json(path, more);
    const std::string type = answer.is_object() ? answer.value("type", "") : "";
    return type.substr(type.rfind(':') + 1);
  }
  /// The dataset of a query; something of it can be read.
  std::string id_of(const std::string& query, const std::string& more = "") {
    const Json answer = json("/v1/live" + query, "-H 'Prefer: wait=500' " + more);
    EXPECT_TRUE(answer.contains("id")) << answer << server_.log();
    return answer.value("id", "");
  }
  Json status(const std::string& id) { return json("/v1/datasets/" + id); }
  /// Height in the middle; 0: there is none.
  double top(const std::string& query) {
    Json answer = json("/v1/live/elevation" + query + "&points=10.2666,46.2666");
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number()
               ? answer["points"][0]["ellipsoidal_height"].get<double>()
               : 0;
  }
  long asked(const std::string& target) const {
    const auto all = host_.asked();
    return std::count(all.begin(), all.end(), target);
  }
  fs::path folder_of(const std::string& id) const { return folder_.path() / "data" / "datasets" / id; }

  RasterHost host_;
};

TEST_F(LiveAddress, AnAddressIsADataset) {
  start();
  const std::string cone = query("/dems/cone.asc");
  const std::string led = whole("/v1/live/tileset.json" + cone);
  EXPECT_THAT(led, AllOf(HasSubstr("307"), HasSubstr("Location: /v1/datasets/cone-"), HasSubstr("Cache-Control: no-store")));
  EXPECT_THAT(body("/v1/live/tileset.json" + cone, "-L"), HasSubstr("geometricError"))
      << "whoever follows waits until it is there\n"
      << server_.log();
  const std::string id = id_of(cone);
  EXPECT_THAT(led, HasSubstr("/v1/datasets/" + id + "/tileset.json"));
  EXPECT_THAT(whole("/v1/live" + cone), AllOf(HasSubstr("200 OK"), HasSubstr("Content-Location: /v1/datasets/" + id)));
  for (const char* path : {"tiles/0/1/0.drc", "terrain/0/1/0.terrain", "terrain-rgb/0/0/0.png"}) {
    const std::string tile = body(std::string("/v1/live/") + path + cone);
    EXPECT_FALSE(tile.empty()) << path;
    EXPECT_EQ(tile, body("/v1/datasets/" + id + "/" + path)) << path;
  }
  EXPECT_THAT(body("/v1/live/layer.json" + cone, "-L"), HasSubstr("terrain/{z}/{x}/{y}.terrain"));
  EXPECT_THAT(json("/v1/live/terrain-rgb.json" + cone, "-L")["tiles"][0].dump(),
              HasSubstr(server_.base() + "/v1/datasets/" + id + "/terrain-rgb/"));
  EXPECT_NEAR(top(cone), 2000, 60);
  EXPECT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  EXPECT_THAT(body("/v1/live/events" + cone, "-L"), HasSubstr("event: ready"));
  EXPECT_THAT(body("/v1/live.pmtiles" + cone + "&format=hillshade", "-L --retry 100"), testing::StartsWith("PMTiles"));
  EXPECT_EQ(body("/v1/live/mesh.stl" + cone + "&level=0", "-L"), body("/v1/datasets/" + id + "/mesh.stl?level=0"));
  EXPECT_THAT(status(id)["source"].dump(), HasSubstr("/dems/cone.asc"));
  EXPECT_EQ(asked("/dems/cone.asc"), 1) << "it was fetched once for all of these";
  EXPECT_NE(id_of(query("/dems/cone.asc", "&title=Other")), id) << "other options, another dataset";
  EXPECT_EQ(slug("/v1/live/tiles/3/7/7.drc" + cone), "tile-unknown");
  EXPECT_THAT(body("/metrics"), HasSubstr("cordillera_http_requests_total{route=\"live\""));
}

TEST_F(LiveAddress, AWaitInVainEndsWithTheStatus) {
  host_.hangs("/dems/slow.asc");
  start();
  const std::string slow = query("/dems/slow.asc");
  for (const std::string wait : {"0", "1"})
    EXPECT_THAT(whole("/v1/live" + slow, "-H 'Prefer: wait=" + wait + "'"),
                AllOf(HasSubstr("202 Accepted"), HasSubstr("\"state\"")));
  EXPECT_EQ(slug("/v1/live/tiles/0/1/0.drc" + slow, "-H 'Prefer: wait=0'"), "tile-not-ready");
}

TEST_F(LiveAddress, OnlyWhatTheOperatorAllowsIsFetched) {
  start();
  EXPECT_EQ(slug("/v1/live"), "option-invalid");
  EXPECT_EQ(slug("/v1/live/tileset.json"), "option-invalid");
  for (const char* target : {"/private/cone.asc", "/dems/../private/cone.asc", "/dems/%2e%2e/x.asc"})
    EXPECT_EQ(slug("/v1/live" + query(target)), "option-forbidden") << target;
  EXPECT_EQ(json("/v1/live?url=file:///etc/passwd")["parameter"], "url");
  EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc", "&eror=3")), "option-unknown");
  for (const char* other : {"&build=full", "&updates=1", "&dry_run=1", "&source=http://127.0.0.1/"})
    EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc", other)), "option-unknown") << other;
  EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc", "&crs=/etc/passwd")), "option-repeated");
  EXPECT_EQ(slug("/v1/live/sources" + query("/dems/cone.asc")), "not-found");
  EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc"), "-H 'Origin: https://elsewhere.example'"), "origin-forbidden");
  EXPECT_EQ(json("/v1/datasets")["datasets"].size(), 0u);
  EXPECT_TRUE(host_.asked().empty());
  server_.end(SIGTERM);
  server_.start(folder_.path());
  const Json none = json("/v1/live" + query("/dems/cone.asc"));
  EXPECT_THAT(none.dump(), AllOf(HasSubstr("option-forbidden"), HasSubstr("--source-allow")));
}

TEST_F(LiveAddress, NobodySeesWhatMayBeASignature) {
  start();
  const std::string sought = query("/dems/signed.asc?sig=secret");
  const std::string id = id_of(sought);
  EXPECT_EQ(asked("/dems/signed.asc?sig=secret"), 1);
  std::string all = whole("/v1/live" + sought) + whole("/v1/live/tileset.json" + sought) +
                    whole("/v1/live/tileset.json" + sought, "-L") + whole("/v1/live/manifest.json" + sought, "-L");
  all += whole("/v1/datasets") + whole("/v1/datasets/" + id) + whole("/v1/datasets/" + id + "/sources") +
         whole("/stac/collections/datasets/items") + whole("/metrics");
  all += whole("/v1/live" + query("/dems/none.asc?sig=secret"), "-H 'Prefer: wait=500'") +
         whole("/v1/live" + query("/private/none.asc?sig=secret"));
  EXPECT_THAT(all, Not(HasSubstr("secret")));
  EXPECT_THAT(all, HasSubstr("/dems/signed.asc"));
  EXPECT_THAT(server_.log(), Not(HasSubstr("secret")));
  EXPECT_THAT(file_text(folder_.path() / "data" / "audit.jsonl"), AllOf(HasSubstr(id), Not(HasSubstr("secret"))));
}

TEST_F(LiveAddress, WhatChangesIsBuiltAnewAndWhatIsGoneGoes) {
  start({"--live-fresh", "0"});
  const std::string cone = query("/dems/cone.asc");
  const std::string id = id_of(cone);
  EXPECT_NEAR(top(cone), 2000, 60);
  ASSERT_TRUE(eventually([&] {
    return body("/metrics").find("cordillera_live_asked_total{outcome=\"same\"}") != std::string::npos;
  })) << server_.log();
  // It may have been asked while provisional tiles were there and the build went on.
  EXPECT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  const std::string told = server_.log(), fetch = "its raster is fetched";
  EXPECT_EQ(told.find(fetch), told.rfind(fetch)) << "it was asked, and is the same\n" << told;
  host_.has_tagged("/dems/cone.asc", cone_of(3000), "\"two\"");
  ASSERT_TRUE(eventually([&] { return std::abs(top(cone) - 3000) < 60; })) << server_.log();
  EXPECT_EQ(id_of(cone), id) << "its address stays";
  host_.has_no_more("/dems/cone.asc");
  ASSERT_TRUE(eventually([&] { return slug("/v1/live/tiles/0/1/0.drc" + cone) == "dataset-failed"; })) << server_.log();
  EXPECT_THAT(body("/v1/live" + cone, "-H 'Prefer: wait=500'"), HasSubstr("source-unreachable"));
  host_.has_tagged("/dems/cone.asc", cone_of(4000), "\"three\"");
  EXPECT_TRUE(eventually([&] { return std::abs(top(cone) - 4000) < 60; })) << "asked for again it is tried again\n"
                                                                           << server_.log();
}

TEST_F(LiveAddress, AKilledServiceFindsItAgain) {
  start();
  const std::string cone = query("/dems/cone.asc");
  const std::string id = id_of(cone), tile = body("/v1/live/tiles/0/1/0.drc" + cone);
  server_.end(SIGKILL);
  start();
  EXPECT_EQ(id_of(cone), id);
  EXPECT_EQ(body("/v1/live/tiles/0/1/0.drc" + cone), tile);
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched")));
  server_.end(SIGTERM);
  ASSERT_EQ(shell(kProgram + " vacuum " + (folder_.path() / "data").string()).code, 0);
  start();
  EXPECT_EQ(body("/v1/live/tiles/0/1/0.drc" + cone), tile);
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched"))) << "the note of what was fetched is still there";
}

TEST_F(LiveAddress, WithTokensOnlyWhoMayPostHasThemFetched) {
  const std::string tokens = (folder_.path() / "tokens").string();
  const auto token = [&](const char* name, const char* role) {
    std::string said =
        shell(kProgram + " token new --name " + name + " --role " + role + " --file " + tokens + " 2>/dev/null").output;
    const auto at = said.find("token: ") + 7;
    return "-H 'Authorization: Bearer " + said.substr(at, said.find('\n', at) - at) + "'";
  };
  const std::string writer = token("writer", "write"), reader = token("reader", "read");
  start({"--tokens", tokens});
  const std::string open = query("/dems/cone.asc"), hidden = query("/dems/cone.asc", "&private=1");
  EXPECT_EQ(slug("/v1/live" + open), "token-missing");
  EXPECT_EQ(slug("/v1/live" + open, reader), "role-too-low");
  EXPECT_THAT(body("/v1/live" + query("/private/x.asc")), Not(HasSubstr(host_.address() + "/dems/")))
      << "what is allowed is not everybody's to know";
  const std::string id = id_of(open, writer);
  EXPECT_THAT(whole("/v1/live/tiles/0/1/0.drc" + open), HasSubstr("200 OK")) << "what is there may be read";
  const std::string secret = id_of(hidden, writer);
  EXPECT_NE(secret, id);
  EXPECT_EQ(slug("/v1/live/tiles/0/1/0.drc" + hidden), "token-missing");
  EXPECT_THAT(whole("/v1/live/tiles/0/1/0.drc" + hidden, reader), AllOf(HasSubstr("200 OK"), Not(HasSubstr("public"))));
  server_.end(SIGTERM);
  start({"--tokens", tokens, "--live-open", "1"});
  EXPECT_THAT(whole("/v1/live/tiles/0/1/0.drc" + query("/dems/cone.asc", "&title=New")), HasSubstr("200 OK"));
  EXPECT_EQ(slug("/v1/live/tiles/0/1/0.drc" + hidden), "token-missing");
  curl("-X PATCH " + writer + " '" + server_.base() + "/v1/datasets/" + id + "?private=1'");
  for (const char* path : {"/v1/live", "/v1/live/tileset.json", "/v1/live/events", "/v1/live/tiles/0/1/0.drc"})
    EXPECT_EQ(slug(path + open), "token-missing") << path << " of a dataset that has become private";
  EXPECT_EQ(slug("/v1/live" + open, reader), "") << "who may read it has it";
}

/// A raster that is read by ranges: a COG that is large beside what is looked at.
class ByRanges : public LiveAddress {
 protected:
  static constexpr int kSide = 2048;
  static constexpr double kWest_deg = 10.74, kNorth_deg = 46.92, kPixel_deg = 0.0005;  // four blocks meet in the middle
  static constexpr const char* kCog = "/dems/hills.tif";
  void SetUp() override {
    raster_ = (folder_.path() / "hills.tif").string();
    hills_ = cog_of(1000);
    host_.has_parts(kCog, hills_, "\"one\"");
  }
  /// Gentle hills about a height in metres. The file stays.
  std::string cog_of(int height) const {
    GDALAllRegister();
    const auto driver = [](const char* name) { return GetGDALDriverManager()->GetDriverByName(name); };
    const GDALDatasetUniquePtr pixels(driver("MEM")->Create("", kSide, kSide, 1, GDT_Int16, nullptr));
    double place[] = {kWest_deg, kPixel_deg, 0, kNorth_deg, 0, -kPixel_deg};
    pixels->SetGeoTransform(place);
    std::vector<std::int16_t> line(kSide);
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column)
        line[static_cast<std::size_t>(column)] =
            static_cast<std::int16_t>(height + 200 * std::sin(column / 300.0) * std::cos(row / 250.0));
      EXPECT_EQ(pixels->GetRasterBand(1)->RasterIO(GF_Write, 0, row, kSide, 1, line.data(), kSide, 1, GDT_Int16, 0, 0, nullptr),
                CE_None);
    }
    const char* options[] = {"COMPRESS=NONE", "BLOCKSIZE=256", nullptr};
    EXPECT_TRUE(GDALDatasetUniquePtr(
        driver("COG")->CreateCopy(raster_.c_str(), pixels.get(), FALSE, const_cast<char**>(options), nullptr, nullptr)));
    return file_text(raster_);
  }
  std::string sought() const { return query(kCog, "&max_level=11"); }
  /// Of the finest level.
  static std::string tile_at(double longitude_deg, double latitude_deg) {
    const double tiles = std::ldexp(1, 11) / 180;
    return "/tiles/11/" + std::to_string(static_cast<int>((180 + longitude_deg) * tiles)) + "/" +
           std::to_string(static_cast<int>((90 + latitude_deg) * tiles)) + ".drc";
  }
  std::string final_tile(const std::string& id, const std::string& tile) {
    return body("/v1/datasets/" + id + tile, "-H 'Prefer: wait=500'");
  }
  std::string posted() {
    return curl("--data-binary @" + raster_ + " -H 'Prefer: wait=500' '" + server_.base() +
                "/v1/datasets?name=hills.tif&crs=EPSG:4326&vertical_datum=ellipsoid&error=20&build=lazy&max_level=11'")
        .value("id", "");
  }
  std::string hills_;
};

TEST_F(ByRanges, OfALargeCogOnlyWhatIsLookedAtComes) {
  start();
  const std::string one = tile_at(11.5, 46.6), other = tile_at(11, 46.2);
  const std::string id = id_of(sought());
  EXPECT_LT(host_.sent(), hills_.size() / 3) << "provisional tiles are made of its overviews";
  const std::string made = final_tile(id, one);
  EXPECT_FALSE(made.empty());
  EXPECT_LT(host_.sent(), hills_.size() * 2 / 3) << server_.log();
  EXPECT_EQ(status(id)["build"], "lazy");
  const std::string copy = posted();
  EXPECT_EQ(final_tile(copy, one), made) << "the bytes of a raster that was posted";
  const std::string backup = (folder_.path() / "backup").string(), data = (folder_.path() / "data").string();
  ASSERT_EQ(shell(kProgram + " backup " + data + " -o " + backup).code, 0);
  server_.end(SIGKILL);
  start();
  const auto before = host_.sent();
  EXPECT_EQ(final_tile(id, one), made);
  EXPECT_EQ(host_.sent(), before);
  EXPECT_EQ(final_tile(id, other), final_tile(copy, other)) << "it goes on where it was";
  EXPECT_LT(host_.sent(), hills_.size());
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched")));
  server_.end(SIGTERM);
  fs::remove_all(data);
  ASSERT_EQ(shell(kProgram + " restore " + backup + " --data " + data).code, 0);
  start();
  EXPECT_EQ(status(id)["asleep"], true) << "a backup has no raster that is there in parts";
  EXPECT_EQ(final_tile(id, one), made) << server_.log();
  EXPECT_TRUE(fs::exists(folder_of(id)));
  shell("curl -q -s -X DELETE '" + server_.base() + "/v1/datasets/" + id + "'");
  EXPECT_FALSE(fs::exists(folder_of(id)));
}

TEST_F(ByRanges, AnAddressIsPostedToo) {
  start();
  const auto post = [&](const std::string& options) {
    return curl("-H 'Prefer: wait=500' -H 'Idempotency-Key: hills' -d source=" + host_.address() + kCog +
                " -d crs=EPSG:4326 -d vertical_datum=ellipsoid -d error=20 -d max_level=12 -d build=lazy " + options + " '" +
                server_.base() + "/v1/datasets'");
  };
  Json posted = post("");
  const std::string id = posted.value("id", "");
  EXPECT_EQ(posted["build"], "lazy") << posted;
  EXPECT_LT(host_.sent(), hills_.size()) << "all provisional tiles are there";
  EXPECT_THAT(body("/v1/datasets/" + id + "/tileset.json"), HasSubstr("geometricError"));
  EXPECT_THAT(status(id)["source"].dump(), HasSubstr(kCog));
  EXPECT_EQ(post("").value("id", ""), id) << "the same request, another answer to it";
  EXPECT_THAT(post("-d updates=1").dump(), HasSubstr("idempotency-key-reused")) << "copied and kept, it would be another dataset";
  EXPECT_THAT(post("-d dry_run=1").dump(), HasSubstr("options-conflict"));
}

TEST_F(ByRanges, ARasterThatChangesMeanwhileIsReadAnew) {
  start();
  const std::string id = id_of(sought());
  host_.has_parts(kCog, cog_of(3000), "\"two\"");
  final_tile(id, tile_at(11.5, 46.6));
  const std::string place = "/elevation?points=11.5,46.6";
  ASSERT_TRUE(eventually([&] {
    Json answer = json("/v1/datasets/" + id + place);
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number() &&
           answer["points"][0]["ellipsoidal_height"].get<double>() > 2500;
  })) << server_.log();
  EXPECT_THAT(server_.log(), HasSubstr("has another raster than it had"));
}

TEST_F(ByRanges, WhoSendsPartsAtFirstAloneIsCopied) {
  host_.has_parts(kCog, hills_, "\"one\"", RasterHost::Parts::not_after_the_first);
  start();
  EXPECT_FALSE(final_tile(id_of(sought()), tile_at(11.5, 46.6)).empty()) << server_.log();
  EXPECT_GE(host_.sent(), hills_.size());
}

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
