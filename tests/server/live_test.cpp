// What can be read of a dataset while its build goes on: provisional tiles at the addresses of the final ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "program_fixture.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using testing::Not;

std::string id_of(const Response& response) { return body_of(response).value("id", ""); }

class Live : public testing::Test {
 protected:
  /// Posted, and its provisional tiles stand.
  std::string posted(const Given& query = {}) {
    const std::string id = id_of(test_.post("LIVE", query));
    EXPECT_TRUE(eventually([&] { return body_of(test_.get(at(id)))["provisional"] == true; }));
    return id;
  }
  static std::string at(const std::string& id, const std::string& path = "") { return "/v1/datasets/" + id + path; }
  void tell_job(const std::string& id, const char* what) { std::ofstream(test_.data() / "datasets" / id / what) << "now"; }
  bool reaches(const std::string& id, const std::string& state) {
    return eventually([&] { return body_of(test_.get(at(id)))["state"] == state; });
  }
  TestService test_;
};

TEST_F(Live, EveryAddressServesProvisionalTilesThatNobodyKeeps) {
  const std::string id = posted();
  for (const char* path : {"/tiles/0/0/0.drc", "/tiles/0/0/0.glb", "/tileset.json", "/manifest.json", "/layer.json"}) {
    const Response answer = test_.get(at(id, path), {{"if-none-match", "*"}});
    EXPECT_EQ(answer.status, 200) << path;
    EXPECT_FALSE(answer.bytes().empty()) << path;
    EXPECT_EQ(answer.header("Cache-Control"), "no-store") << path;
    EXPECT_EQ(answer.header("Cordillera-Provisional"), "true") << path;
    EXPECT_EQ(answer.header("ETag"), "") << path;
    EXPECT_THAT(answer.header("Access-Control-Expose-Headers"), HasSubstr("Cordillera-Provisional")) << path;
    EXPECT_FALSE(answer.same_while.has_value()) << path;
  }
  EXPECT_EQ(test_.get(at(id, "/tiles/0/0/0.drc")).body, "provisional drc of 0");
  const Json manifest = body_of(test_.get(at(id, "/manifest.json")));
  EXPECT_EQ(manifest["provisional"], true);
  EXPECT_TRUE(manifest["levels"][0]["stated_max_error"].is_null());
  EXPECT_EQ(body_of(test_.get(at(id, "/tileset.json")))["asset"]["extras"]["provisional"], true);
  const Json status = body_of(test_.get(at(id)));
  EXPECT_EQ(status["state"], "running");
  EXPECT_TRUE(status["links"].contains("tileset"));
  EXPECT_FALSE(status["links"].contains("mesh"));
  EXPECT_TRUE(status["manifest"].is_null());
  EXPECT_FALSE(status["faces"].empty());
}

TEST_F(Live, WhatProvisionalTilesDoNotHaveSaysSo) {
  const std::string id = posted();
  const Response finer = test_.get(at(id, "/tiles/1/1/1.drc"));
  EXPECT_EQ(finer.status, 404);
  EXPECT_EQ(finer.header("Cache-Control"), "no-store");
  EXPECT_THAT(finer.bytes(), HasSubstr("while the dataset is being built"));
  EXPECT_EQ(slug_of(test_.get(at(id, "/mesh.glb"))), "dataset-not-ready") << "a mesh that somebody keeps is a final one";
  EXPECT_EQ(slug_of(test_.get(at(id, "/versions/0123456789abcdef/tileset.json"))), "dataset-not-ready");
}

TEST_F(Live, TheFinalTilesTakeTheirPlace) {
  const std::string id = posted();
  tell_job(id, "go");
  ASSERT_TRUE(reaches(id, "ready"));
  const Response tile = test_.get(at(id, "/tiles/0/0/0.drc"));
  EXPECT_EQ(tile.body, "drc of 0");
  EXPECT_EQ(tile.header("Cordillera-Provisional"), "");
  EXPECT_EQ(tile.header("Cache-Control"), "public, no-cache");
  EXPECT_NE(tile.header("ETag"), "");
  EXPECT_EQ(body_of(test_.get(at(id)))["provisional"], false);
  EXPECT_EQ(body_of(test_.get(at(id, "/manifest.json")))["provisional"], false);
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(test_.service().layout().provisional(id)); }));
}

TEST_F(Live, EventsTellWhichTilesAreNew) {
  const std::string id = posted();
  Response stream = test_.get(at(id, "/events"));
  const std::string first = stream.next_piece().value_or("");
  EXPECT_THAT(first, HasSubstr("event: tiles\ndata: {\"provisional\":true,\"levels\":[{\"level\":0,\"x\":[0,0],\"y\":[0,0]}],"));
  EXPECT_THAT(first, HasSubstr("],\"tiles\":1}")) << "a sharper step has the same levels and bounds";
  EXPECT_THAT(first, HasSubstr("event: progress"));
  test_.service().hub().touch(id);
  EXPECT_THAT(stream.next_piece().value_or(""), Not(HasSubstr("event: tiles"))) << "told already";
  tell_job(id, "go");
  ASSERT_TRUE(reaches(id, "ready"));
  std::string rest;
  while (auto piece = stream.next_piece()) rest += *piece;
  EXPECT_THAT(rest, HasSubstr("event: tiles\ndata: {\"provisional\":false,\"levels\":[{\"level\":0,\"x\":[0,0],\"y\":[0,0]},{\"level\":1,\"x\":[1,1],\"y\":[1,1]}],"));
  EXPECT_LT(rest.find("event: tiles"), rest.find("event: ready"));
}

TEST_F(Live, AFailedBuildTakesThemAway) {
  const std::string id = posted();
  tell_job(id, "fail");
  ASSERT_TRUE(reaches(id, "failed"));
  EXPECT_EQ(slug_of(test_.get(at(id, "/tiles/0/0/0.drc"))), "dataset-failed");
  EXPECT_EQ(body_of(test_.get(at(id)))["provisional"], false);
}

TEST_F(Live, ADeletionTakesThemAway) {
  const std::string id = posted();
  EXPECT_EQ(test_.send("DELETE", at(id)).status, 204);
  EXPECT_EQ(test_.get(at(id, "/tiles/0/0/0.drc")).status, 404);
  EXPECT_EQ(slug_of(test_.get(at(id, "/tiles/0/0/0.drc"))), "dataset-unknown");
  EXPECT_EQ(test_.leftovers(), 0u);
}

TEST_F(Live, ARestartedServiceServesWhatStands) {
  const std::string id = posted();
  test_.stop();
  std::ofstream(test_.data() / "datasets" / id / kNextProvisional) << "half of a store";
  test_.start();
  EXPECT_EQ(test_.get(at(id, "/tiles/0/0/0.drc")).body, "provisional drc of 0");
  tell_job(id, "go");
  ASSERT_TRUE(reaches(id, "ready"));
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(test_.data() / "datasets" / id / kNextProvisional); }));
}

TEST_F(Live, ARasterThatWaitsForAnotherIsShownAtOnce) {
  const std::string first = posted(), behind = posted();  // one build at a time
  EXPECT_EQ(body_of(test_.get(at(behind)))["state"], "queued");
  EXPECT_EQ(test_.get(at(behind, "/tiles/0/0/0.drc")).body, "provisional drc of 0");
  Response stream = test_.get(at(behind, "/events"));
  EXPECT_THAT(stream.next_piece().value_or(""), HasSubstr("event: tiles"));
  EXPECT_EQ(test_.send("DELETE", at(behind)).status, 204);
  tell_job(first, "go");
  EXPECT_TRUE(reaches(first, "ready"));
}

TEST_F(Live, OffMeansNoneUntilTheBuildIsDone) {
  const std::string id = id_of(test_.post("LIVE", {{"provisional", "off"}}));
  EXPECT_TRUE(eventually([&] { return test_.service().hub().now(id).progress.has_value(); }));
  EXPECT_EQ(slug_of(test_.get(at(id, "/tileset.json"))), "dataset-not-ready");
  EXPECT_EQ(test_.get(at(id, "/tileset.json")).header("Retry-After"), "2");
  EXPECT_EQ(body_of(test_.get(at(id)))["provisional"], false);
  tell_job(id, "go");
  EXPECT_TRUE(reaches(id, "ready"));
}

TEST_F(Live, MetricsHaveTheTimeToTheFirstTile) {
  const std::string id = posted();
  EXPECT_THAT(test_.service().metrics().text(), HasSubstr("cordillera_first_tile_seconds_count{kind=\"provisional\"} 1"));
  tell_job(id, "go");
  ASSERT_TRUE(reaches(id, "ready"));
  EXPECT_THAT(test_.service().metrics().text(), Not(HasSubstr("kind=\"final\""))) << "those were not its first";
  ASSERT_TRUE(reaches(id_of(test_.post("GOOD")), "ready"));
  EXPECT_TRUE(eventually([&] { return test_.service().metrics().text().find("cordillera_first_tile_seconds_count{kind=\"final\"} 1") != std::string::npos; }));
}

/// The program with a raster whose build takes long enough to look at it meanwhile.
class LiveProgram : public Program {
 protected:
  void SetUp() override {
    constexpr int kSide = 640;
    raster_ = (folder_.path() / "hills.asc").string();
    std::ofstream out(raster_);
    out << "ncols " << kSide << "\nnrows " << kSide << "\nxllcorner 10\nyllcorner 46\ncellsize 0.0005\n";
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column) out << static_cast<int>(1000 + 300 * std::sin(column / 9.0) * std::cos(row / 7.0)) << ' ';
      out << '\n';
    }
    out.close();
    start_server();
  }
  /// Its provisional tiles stand, and its build goes on.
  std::string posted(const std::string& options = "&error=2") {
    const Json answer = curl("--data-binary @" + raster_ + " '" + server_.base() + "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&threads=1" + options + "'");
    const std::string id = answer.value("id", "");
    EXPECT_TRUE(eventually([&] { return status(id)["provisional"] == true; })) << answer.dump() << server_.log();
    return id;
  }
  Json status(const std::string& id) { return curl(server_.base() + "/v1/datasets/" + id); }
  Json get(const std::string& id, const std::string& path) { return curl(server_.base() + "/v1/datasets/" + id + path); }
  std::string head(const std::string& id, const std::string& path) { return shell("curl -q -s -m 500 -D - -o /dev/null " + server_.base() + "/v1/datasets/" + id + path).output; }
  /// A tile of the level that holds the raster's middle.
  static std::string middle(int level) {
    const double tiles = std::ldexp(1, level) / 180;
    return "/tiles/" + std::to_string(level) + "/" + std::to_string(static_cast<int>((10.15 + 180) * tiles)) + "/" + std::to_string(static_cast<int>((46.15 + 90) * tiles)) + ".drc";
  }
  bool is_ready(const std::string& id) {
    return eventually([&] { return status(id)["state"] == "ready"; });
  }
  std::filesystem::path folder_of(const std::string& id) const { return folder_.path() / "data" / "datasets" / id; }
};

TEST_F(LiveProgram, TilesAreThereBeforeTheBuildIsDone) {
  const std::string id = posted();
  const Json manifest = get(id, "/manifest.json");
  ASSERT_EQ(manifest["provisional"], true) << manifest;
  EXPECT_EQ(manifest["source"]["columns"], 640) << "the raster is described, not what was read of it";
  EXPECT_TRUE(manifest["levels"][0]["stated_max_error"].is_null());
  const int level = manifest["max_level"];
  const std::string found = head(id, middle(level));
  EXPECT_THAT(found, HasSubstr("200 OK"));
  EXPECT_THAT(found, HasSubstr("Cordillera-Provisional: true"));
  EXPECT_THAT(found, HasSubstr("Cache-Control: no-store"));
  const Json heights = get(id, "/elevation?points=10.15,46.15");
  EXPECT_NEAR(heights["points"][0]["ellipsoidal_height"].get<double>(), 1000, 400) << heights;
  EXPECT_TRUE(heights["stated_max_error"].is_null());
  for (const char* path : {"/tileset.json", "/layer.json", "/terrain-rgb.json", "/hillshade.json", "/tileset-explicit.json", "/terrain3d/tileset.json"}) {
    const std::string document = head(id, path);
    EXPECT_TRUE(document.find("200 OK") != std::string::npos && document.find("no-store") != std::string::npos) << path << document;
  }
  ASSERT_TRUE(is_ready(id));
  const Json built = get(id, "/manifest.json");
  EXPECT_GT(built["max_level"], level);
  EXPECT_EQ(built["provisional"], false);
  EXPECT_FALSE(built["options"].contains("provisional"));
  EXPECT_THAT(head(id, middle(level)), Not(HasSubstr("Provisional: true")));
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(folder_of(id) / kProvisionalStore); }));
}

TEST_F(LiveProgram, AKilledJobLeavesThemAndGoesOn) {
  const std::string id = posted();
  kill(server_.child_process(), SIGKILL);
  EXPECT_EQ(status(id)["provisional"], true);
  EXPECT_THAT(head(id, "/tileset.json"), HasSubstr("200 OK"));
  ASSERT_TRUE(is_ready(id)) << server_.log();
  EXPECT_EQ(status(id)["provisional"], false);
}

TEST_F(LiveProgram, AKilledServerServesThemAgain) {
  const std::string id = posted();
  server_.end(SIGKILL);
  std::ofstream(folder_of(id) / kNextProvisional) << "half of a store";
  start_server();
  EXPECT_THAT(head(id, "/tileset.json"), HasSubstr("200 OK"));
  ASSERT_TRUE(is_ready(id)) << server_.log();
  EXPECT_FALSE(std::filesystem::exists(folder_of(id) / kNextProvisional));
}

TEST_F(LiveProgram, ADeletionInTheMiddleLeavesNothing) {
  const std::string id = posted();
  EXPECT_THAT(shell("curl -q -s -m 500 -D - -X DELETE " + server_.base() + "/v1/datasets/" + id).output, HasSubstr("204"));
  EXPECT_THAT(head(id, "/tileset.json"), HasSubstr("404"));
  EXPECT_FALSE(std::filesystem::exists(folder_of(id)));
}

/// Of a lazy dataset: where people look there are the finest tiles, elsewhere not, over restarts too; and all of them once somebody wants all.
class LazyProgram : public LiveProgram {
 protected:
  /// A finest tile, so far south-west or north-east of the middle that its block is another.
  std::string finest(double shift_deg) const {
    const double tiles = std::ldexp(1, kFinest) / 180;
    const auto at = [&](double deg) { return std::to_string(static_cast<int>((deg + shift_deg) * tiles)); };
    return "/tiles/" + std::to_string(kFinest) + "/" + at(10.15 + 180) + "/" + at(46.15 + 90) + ".drc";
  }
  bool is_there(const std::string& id, const std::string& path) { return head(id, path).find("200 OK") != std::string::npos; }
  static constexpr int kFinest = 13;
  static constexpr double kAway_deg = 0.12;
  const std::string lazy_ = "&error=8&build=lazy&max_level=" + std::to_string(kFinest);
};

TEST_F(LazyProgram, BlocksAreMadeWhereSomebodyLooks) {
  const std::string id = posted(lazy_);
  ASSERT_TRUE(eventually([&] { return get(id, "/manifest.json")["done_blocks"].is_object(); })) << get(id, "/manifest.json") << server_.log();
  EXPECT_EQ(status(id)["build"], "lazy");
  EXPECT_EQ(status(id)["state"], "running");
  EXPECT_TRUE(status(id)["progress"]["seconds_left"].is_null());
  EXPECT_FALSE(is_there(id, finest(-kAway_deg)));
  const int block_level = get(id, "/manifest.json")["done_blocks"]["level"];
  const double tiles = std::ldexp(1, block_level) / 180;
  const auto look = [&](double shift_deg) {
    const auto at = [&](double deg) { return std::to_string(static_cast<int>((deg + shift_deg) * tiles)); };
    return head(id, "/tiles/" + std::to_string(block_level) + "/" + at(10.15 + 180) + "/" + at(46.15 + 90) + ".glb");
  };
  EXPECT_THAT(look(-kAway_deg), HasSubstr("200 OK"));
  ASSERT_TRUE(eventually([&] { return is_there(id, finest(-kAway_deg)); })) << server_.log();
  EXPECT_FALSE(is_there(id, finest(kAway_deg))) << "nobody has looked there";
  server_.end(SIGKILL);
  start_server();
  EXPECT_TRUE(is_there(id, finest(-kAway_deg)));
  EXPECT_FALSE(is_there(id, finest(kAway_deg)));
  EXPECT_THAT(get(id, "/elevation?points=10.27,46.27").dump(), HasSubstr("ellipsoidal_height"));
  EXPECT_TRUE(eventually([&] { return is_there(id, finest(kAway_deg)); })) << "a height is a look, too\n" << server_.log();
  const auto bytes = [&] { return shell("curl -q -s -m 500 " + server_.base() + "/v1/datasets/" + id + finest(kAway_deg) + " | sha256sum").output; };
  const std::string before = bytes();
  EXPECT_EQ(curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=lazy'")["type"], "urn:cordillera:problem:option-invalid");
  EXPECT_EQ(curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=full'").value("id", ""), id);
  ASSERT_TRUE(is_ready(id)) << server_.log();
  EXPECT_EQ(bytes(), before);
  EXPECT_EQ(status(id)["build"], "full");
}

TEST_F(LazyProgram, SmallRastersAreBuiltAtOnce) {
  const std::string post = "--data-binary @" + raster_ + " '" + server_.base() + "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=20&build=lazy'";
  const std::string id = curl(post).value("id", "");
  EXPECT_TRUE(eventually([&] { return status(id)["state"] != "queued"; }));
  curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=full'");
  EXPECT_TRUE(is_ready(id)) << server_.log();
  EXPECT_TRUE(is_ready(curl(post).value("id", ""))) << "what waited before it has had its turn";
  EXPECT_EQ(status(id)["state"], "ready") << "a second turn finds a dataset that is built\n" << server_.log();
}

TEST_F(LazyProgram, PlacesBesideTheDataWakeNobody) {
  const std::string id = posted(lazy_);
  ASSERT_TRUE(eventually([&] { return get(id, "/manifest.json")["done_blocks"].is_object() && server_.log().find("outcome=paused") != std::string::npos; })) << server_.log();
  const auto begun = [&] {
    const std::string log = server_.log(), words = "build started";
    int count = 0;
    for (auto at = log.find(words); at != log.npos; at = log.find(words, at + 1)) ++count;
    return count;
  };
  const int before = begun();
  get(id, "/elevation?points=0,0");
  EXPECT_FALSE(is_there(id, "/tiles/13/0/0.drc"));
  EXPECT_FALSE(is_there(id, finest(0)));  // that one does
  EXPECT_TRUE(eventually([&] { return is_there(id, finest(0)); })) << "a tile that is not there yet is made\n" << server_.log();
  EXPECT_EQ(begun(), before + 1);
}

TEST_F(LazyProgram, WhatDoesNotGoWithItIsRefused) {
  for (const char* against : {"updates=1", "provisional=off", "keep=0.1"}) {
    const Json answer = curl("--data-binary @" + raster_ + " '" + server_.base() + "/v1/datasets?name=hills.asc&crs=EPSG:4326&build=lazy&" + against + "'");
    EXPECT_EQ(answer.value("parameter", ""), "build") << against << answer;
  }
}

/// Tiles are the same with a first look and without.
TEST_F(LiveProgram, TheBuildIsTheSame) {
  const std::string options = "&crs=EPSG:4326&vertical_datum=ellipsoid&error=5", post = "--data-binary @" + raster_ + " '" + server_.base() + "/v1/datasets?name=hills.asc" + options;
  const std::string with = curl(post + "'").value("id", ""), without = curl(post + "&provisional=off'").value("id", "");
  ASSERT_TRUE(is_ready(with) && is_ready(without));
  const int finest = get(with, "/manifest.json")["max_level"];
  for (int level = 0; level <= finest; ++level) {
    const auto bytes = [&](const std::string& id) { return shell("curl -q -s -m 500 " + server_.base() + "/v1/datasets/" + id + middle(level) + " | sha256sum").output; };
    EXPECT_EQ(bytes(with), bytes(without)) << "level " << level;
  }
}

}  // namespace
}  // namespace cordillera::server
