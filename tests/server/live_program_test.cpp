// The real program with a raster whose build takes long enough to look at it meanwhile: provisional tiles, and blocks that are
// made where somebody looks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <set>

#include "live_program_fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using testing::Not;

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
  for (const char* path : {"/tileset.json", "/layer.json", "/terrain-rgb.json", "/hillshade.json", "/tileset-explicit.json",
                           "/terrain3d/tileset.json"}) {
    const std::string document = head(id, path);
    EXPECT_TRUE(document.find("200 OK") != std::string::npos && document.find("no-store") != std::string::npos)
        << path << document;
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
  for (const char* options : {"&error=2", "&error=2&updates=1"}) {
    const std::string id = posted(options);
    server_.end(SIGKILL);
    std::ofstream(folder_of(id) / kNextProvisional) << "half of a store";
    start_server();
    EXPECT_THAT(head(id, "/tileset.json"), HasSubstr("200 OK")) << options;
    ASSERT_TRUE(is_ready(id)) << options << server_.log();
    EXPECT_FALSE(std::filesystem::exists(folder_of(id) / kNextProvisional)) << options;
  }
}

// One build at a time: rasters of a dataset that can be changed are looked at while it waits for its turn, too.
TEST_F(LiveProgram, RastersThatCanBeChangedAreShownWhileTheyWait) {
  const std::string first = posted("&error=1"), behind = posted("&error=8&updates=1");
  const std::string first_tiles = "dataset " + behind + ": first tiles";  // written a moment after they can be seen
  ASSERT_TRUE(eventually([&] { return server_.log().find(first_tiles) != std::string::npos; })) << server_.log();
  const std::string log = server_.log();
  const auto shown = log.find(first_tiles), begun = log.find("dataset " + behind + ": version 1 started");
  EXPECT_LT(shown, begun) << "nobody waits for another's build to see something\n" << log;
  curl("-X DELETE " + server_.base() + "/v1/datasets/" + first);
  ASSERT_TRUE(is_ready(behind)) << server_.log();
}

TEST_F(LiveProgram, ADeletionInTheMiddleLeavesNothing) {
  const std::string id = posted();
  EXPECT_THAT(shell("curl -q -s -m 500 -D - -X DELETE " + server_.base() + "/v1/datasets/" + id).output, HasSubstr("204"));
  EXPECT_THAT(head(id, "/tileset.json"), HasSubstr("404"));
  EXPECT_FALSE(std::filesystem::exists(folder_of(id)));
}

/// Where people look there are the finest tiles, elsewhere not, over restarts too; and all of them once somebody wants all.
TEST_F(LazyProgram, BlocksAreMadeWhereSomebodyLooks) {
  const std::string id = posted(lazy_);
  std::set<std::string> told;
  ASSERT_TRUE(eventually([&] {
    told.insert(status(id).value("build", ""));
    return get(id, "/manifest.json")["done_blocks"].is_object();
  })) << get(id, "/manifest.json")
      << server_.log();
  EXPECT_EQ(told, std::set<std::string>{"lazy"}) << "with provisional tiles alone, too";
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
  ASSERT_TRUE(eventually([&] { return !get(id, "/manifest.json")["done_blocks"]["x"].empty(); }))
      << "its finest tiles come first";
  EXPECT_FALSE(is_there(id, finest(kAway_deg))) << "nobody has looked there";
  server_.end(SIGKILL);
  start_server();
  const Json again = status(id)["progress"];
  EXPECT_GT(again["share"], 0.1) << "what is made is told: " << again;
  EXPECT_TRUE(is_there(id, finest(-kAway_deg)));
  EXPECT_FALSE(is_there(id, finest(kAway_deg)));
  EXPECT_THAT(get(id, "/elevation?points=10.27,46.27").dump(), HasSubstr("ellipsoidal_height"));
  EXPECT_TRUE(eventually([&] { return is_there(id, finest(kAway_deg)); })) << "a height is a look, too\n" << server_.log();
  const auto bytes = [&] {
    return shell("curl -q -s -m 500 " + server_.base() + "/v1/datasets/" + id + finest(kAway_deg) + " | sha256sum").output;
  };
  const std::string before = bytes();
  EXPECT_EQ(curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=lazy'")["type"],
            "urn:cordillera:problem:option-invalid");
  EXPECT_EQ(curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=full'").value("id", ""), id);
  ASSERT_TRUE(is_ready(id)) << server_.log();
  EXPECT_EQ(bytes(), before);
  EXPECT_EQ(status(id)["build"], "full");
}

/// With updates=1: its blocks too, with the bytes of a full build; another raster has all of them made first.
TEST_F(LazyProgram, RastersThatCanBeChangedToo) {
  const std::string options = "&updates=1&error=8&max_level=" + std::to_string(kFinest);
  const std::string full = posted(options);
  ASSERT_TRUE(is_ready(full)) << server_.log();
  const std::string id = posted(options + "&build=lazy");
  ASSERT_TRUE(eventually([&] { return get(id, "/manifest.json")["done_blocks"].is_object(); })) << server_.log();
  const auto bytes = [&](const std::string& of) {
    return shell("curl -q -s -m 500 -H 'Prefer: wait=500' " + server_.base() + "/v1/datasets/" + of + finest(-kAway_deg) +
                 " | sha256sum")
        .output;
  };
  EXPECT_FALSE(is_there(id, finest(-kAway_deg)));
  server_.end(SIGTERM);
  server_.start(folder_.path(), {"--max-wait", "500"});
  EXPECT_EQ(bytes(id), bytes(full));
  EXPECT_FALSE(is_there(id, finest(kAway_deg))) << "nobody has looked there";
  EXPECT_EQ(status(id)["state"], "running");
  Json made;
  ASSERT_TRUE(eventually([&] { return (made = get(id, "/manifest.json")["done_blocks"])["x"].size() == 2; }))
      << "there somebody has by now\n"
      << server_.log();
  server_.end(SIGTERM);
  const auto left = finest_store({1, 0, 0}) + kBeingWritten;
  for (const std::string& unfinished : {std::string(kNextProvisional), left, left + "-wal"})
    std::ofstream(folder_of(id) / unfinished) << "half of a store";
  server_.start(folder_.path(), {"--max-wait", "500"});
  EXPECT_EQ(get(id, "/manifest.json")["done_blocks"], made) << "what was shown is shown again";
  EXPECT_TRUE(is_there(id, finest(-kAway_deg)));
  for (const std::string& unfinished : {std::string(kNextProvisional), left, left + "-wal"})
    EXPECT_FALSE(std::filesystem::exists(folder_of(id) / unfinished)) << unfinished;
  const Json change = curl("--data-binary @" + raster_ + " -H 'Prefer: wait=500' '" + server_.base() + "/v1/datasets/" + id +
                           "/sources?name=again.asc&crs=EPSG:4326'");
  EXPECT_EQ(change.value("state", ""), "done") << change << server_.log();
  EXPECT_EQ(status(id)["state"], "ready");
  EXPECT_EQ(get(id, "/sources")["version"], 2);
  EXPECT_TRUE(is_there(id, finest(kAway_deg)));
}

TEST_F(LazyProgram, SmallRastersAreBuiltAtOnce) {
  const std::string post = "--data-binary @" + raster_ + " '" + server_.base() +
                           "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=20&build=lazy'";
  const std::string id = curl(post).value("id", "");
  EXPECT_TRUE(eventually([&] { return status(id)["state"] != "queued"; }));
  curl("-X PATCH '" + server_.base() + "/v1/datasets/" + id + "?build=full'");
  EXPECT_TRUE(is_ready(id)) << server_.log();
  EXPECT_TRUE(is_ready(curl(post).value("id", ""))) << "what waited before it has had its turn";
  EXPECT_EQ(status(id)["state"], "ready") << "a second turn finds a dataset that is built\n" << server_.log();
}

/// Who posts one and waits is told when it can be read, also while another build goes on. One block is built in full, and waited
/// for.
TEST_F(LazyProgram, WhoWaitsForOneWaitsForItsProvisionalTiles) {
  const std::string first = posted("&error=1");
  const pid_t held = server_.child_process();
  ASSERT_EQ(kill(held, SIGSTOP), 0);
  const Json answer = curl("--data-binary @" + raster_ + " -H 'Prefer: wait=500' '" + server_.base() +
                           "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid" + lazy_ + "'");
  EXPECT_EQ(answer["state"], "queued") << answer;
  EXPECT_EQ(answer["provisional"], true) << answer;
  EXPECT_EQ(answer["build"], "lazy") << answer;
  const Ended waited = shell(kProgram + " post " + raster_ + " --server " + server_.base() +
                             " --crs EPSG:4326 --vertical-datum ellipsoid --error 8 --max-level 13 --build lazy --wait --quiet");
  EXPECT_EQ(waited.code, 0) << waited.output;
  EXPECT_THAT(waited.output, HasSubstr("can be seen"));
  EXPECT_EQ(kill(held, SIGCONT), 0);
  const Json whole = curl("--data-binary @" + raster_ + " -H 'Prefer: wait=500' '" + server_.base() +
                          "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&error=2&build=lazy'");
  EXPECT_EQ(whole["state"], "ready") << whole;
  EXPECT_THAT(server_.log(), HasSubstr("dataset " + whole.value("id", "") + ": first tiles")) << "it had provisional tiles";
}

TEST_F(LazyProgram, PlacesBesideTheDataWakeNobody) {
  const std::string id = posted(lazy_);
  ASSERT_TRUE(eventually([&] {
    return get(id, "/manifest.json")["done_blocks"].is_object() && server_.log().find("outcome=paused") != std::string::npos;
  })) << server_.log();
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
  for (const char* against : {"provisional=off", "keep=0.1"}) {
    const Json answer = curl("--data-binary @" + raster_ + " '" + server_.base() +
                             "/v1/datasets?name=hills.asc&crs=EPSG:4326&build=lazy&" + against + "'");
    EXPECT_EQ(answer.value("parameter", ""), "build") << against << answer;
  }
}

/// Tiles are the same with a first look and without.
TEST_F(LiveProgram, TheBuildIsTheSame) {
  const std::string options = "&crs=EPSG:4326&vertical_datum=ellipsoid&error=5",
                    post = "--data-binary @" + raster_ + " '" + server_.base() + "/v1/datasets?name=hills.asc" + options;
  const std::string with = curl(post + "'").value("id", ""), without = curl(post + "&provisional=off'").value("id", "");
  ASSERT_TRUE(is_ready(with) && is_ready(without));
  const int finest = get(with, "/manifest.json")["max_level"];
  for (int level = 0; level <= finest; ++level) {
    const auto bytes = [&](const std::string& id) {
      return shell("curl -q -s -m 500 " + server_.base() + "/v1/datasets/" + id + middle(level) + " | sha256sum").output;
    };
    EXPECT_EQ(bytes(with), bytes(without)) << "level " << level;
  }
}

}  // namespace
}  // namespace cordillera::server
