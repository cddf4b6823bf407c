// The real program with a raster whose build takes long enough to look at it meanwhile: provisional tiles, and blocks that are
// made where somebody looks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <set>

#include "program_fixture.h"
#include "raw_client.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using testing::Not;

/// The program with a raster whose build takes long enough to look at it meanwhile.
class LiveProgram : public Program {
 protected:
  void SetUp() override {
    constexpr int kSide = 640;
    raster_ = (folder_.path() / "hills.asc").string();
    std::ofstream out(raster_);
    out << "ncols " << kSide << "\nnrows " << kSide << "\nxllcorner 10\nyllcorner 46\ncellsize 0.0005\n";
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column)
        out << static_cast<int>(1000 + 300 * std::sin(column / 9.0) * std::cos(row / 7.0)) << ' ';
      out << '\n';
    }
    out.close();
    start_server();
  }
  /// Its provisional tiles stand, and its build goes on.
  std::string posted(const std::string& options = "&error=2") {
    const Json answer = curl("--data-binary @" + raster_ + " '" + server_.base() +
                             "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&threads=1" + options + "'");
    const std::string id = answer.value("id", "");
    EXPECT_TRUE(eventually([&] { return status(id)["provisional"] == true; })) << answer.dump() << server_.log();
    return id;
  }
  Json status(const std::string& id) { return curl(server_.base() + "/v1/datasets/" + id); }
  Json get(const std::string& id, const std::string& path) { return curl(server_.base() + "/v1/datasets/" + id + path); }
  std::string head(const std::string& id, const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -m 500 -D - -o /dev/null " + more + server_.base() + "/v1/datasets/" + id + path).output;
  }
  /// A tile of the level that holds the raster's middle.
  static std::string middle(int level) {
    const double tiles = std::ldexp(1, level) / 180;
    return "/tiles/" + std::to_string(level) + "/" + std::to_string(static_cast<int>((10.15 + 180) * tiles)) + "/" +
           std::to_string(static_cast<int>((46.15 + 90) * tiles)) + ".drc";
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
  const std::string log = server_.log();
  const auto shown = log.find("dataset " + behind + ": first tiles"),
             begun = log.find("dataset " + behind + ": version 1 started");
  EXPECT_NE(shown, log.npos) << log;
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

/// Of a lazy dataset: where people look there are the finest tiles, elsewhere not, over restarts too; and all of them once
/// somebody wants all.
class LazyProgram : public LiveProgram {
 protected:
  /// A finest tile, so far south-west or north-east of the middle that its block is another.
  std::string finest(double shift_deg) const {
    const double tiles = std::ldexp(1, kFinest) / 180;
    const auto at = [&](double deg) { return std::to_string(static_cast<int>((deg + shift_deg) * tiles)); };
    return "/tiles/" + std::to_string(kFinest) + "/" + at(10.15 + 180) + "/" + at(46.15 + 90) + ".drc";
  }
  /// Now: nobody waits for it.
  bool is_there(const std::string& id, const std::string& path) {
    return head(id, path, "-H 'Prefer: wait=0' ").find("200 OK") != std::string::npos;
  }
  static constexpr int kFinest = 13;
  static constexpr double kAway_deg = 0.12;
  const std::string lazy_ = "&error=8&build=lazy&max_level=" + std::to_string(kFinest);
};

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

/// Who asks for the final tile gets it, with the bytes and the tag of a full build.
class LazyWait : public LazyProgram {
 protected:
  void SetUp() override {
    LazyProgram::SetUp();
    restart_with_limit("600");  // longer than the slowest machine takes
  }
  void restart_with_limit(const char* seconds) {
    server_.end(SIGTERM);
    server_.start(folder_.path(), {"--max-wait", seconds});
  }
  /// Its levels are known, none of its blocks is made, and its job has ended.
  std::string paused() {
    const std::string id = posted(lazy_);
    EXPECT_TRUE(eventually([&] {
      return get(id, "/manifest.json")["done_blocks"].is_object() && server_.log().find("outcome=paused") != std::string::npos;
    })) << server_.log();
    return id;
  }
  /// Head and hash of the body.
  std::string whole(const std::string& id, const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -m 500 -D - -o body-$$ --output-dir " + folder_.path().string() + " " + more + " '" +
                 server_.base() + "/v1/datasets/" + id + path + "'; sha256sum < " + folder_.path().string() + "/body-$$")
        .output;
  }
  static std::string line_of(const std::string& text, const std::string& begin) {
    const auto at = text.find(begin);
    return at == text.npos ? "" : text.substr(at, text.find_first_of("\r\n", at) - at);
  }
  static std::string hash_of(const std::string& text) { return text.substr(text.rfind("\r\n") + 2); }
  /// A tile of the blocks' level, which has a stand-in from the beginning.
  std::string of_block_level(const std::string& id) {
    const int level = get(id, "/manifest.json")["done_blocks"]["level"];
    return middle(level);
  }
};

TEST_F(LazyWait, TheAnswerIsThatOfAFullBuild) {
  const std::string full = posted("&error=8&max_level=" + std::to_string(kFinest));
  ASSERT_TRUE(is_ready(full)) << server_.log();
  const std::string lazy = paused();
  const std::string drc = finest(0), glb = drc.substr(0, drc.size() - 3) + "glb";
  for (const std::string& path : {drc, glb}) {
    const std::string made = whole(lazy, path), wanted = whole(full, path);
    EXPECT_THAT(made, HasSubstr("200 OK")) << path << server_.log();
    EXPECT_EQ(hash_of(made), hash_of(wanted)) << path;
    EXPECT_EQ(line_of(made, "ETag: "), line_of(wanted, "ETag: ")) << path;
    EXPECT_EQ(line_of(made, "Cache-Control: "), line_of(wanted, "Cache-Control: ")) << path;
    EXPECT_THAT(made, Not(HasSubstr("Provisional: true"))) << path;
    EXPECT_THAT(whole(lazy, path, "-H 'If-None-Match: " + line_of(wanted, "ETag: ").substr(6) + "'"), HasSubstr("304")) << path;
  }
  EXPECT_EQ(status(lazy)["state"], "running") << "one block is not all";
  EXPECT_THAT(whole(lazy, "/tiles/" + std::to_string(kFinest + 1) + "/1/1.drc"), HasSubstr("404"))
      << "no dataset has such a level";
}

TEST_F(LazyWait, ManyAskersMakeABlockOnce) {
  const std::string id = paused();
  const std::string address = server_.base() + "/v1/datasets/" + id + finest(0);
  const std::string said = shell("for k in 1 2 3 4 5 6 7 8 9 10 11 12; do curl -q -s -m 500 -o /dev/null -w '%{http_code}\\n' " +
                                 address + " & done; wait")
                               .output;
  EXPECT_EQ(count_of(said, "200\n"), 12u) << said << server_.log();
  // They have their tile, and the rest of the block may be on its way.
  EXPECT_TRUE(eventually([&] { return get(id, "/manifest.json")["done_blocks"]["x"].size() == 1; }))
      << get(id, "/manifest.json") << server_.log();
  const auto blocks = [&] { return shell("curl -q -s " + server_.base() + "/metrics").output; };
  EXPECT_TRUE(eventually([&] { return blocks().find("cordillera_build_blocks_total 1\n") != std::string::npos; })) << blocks();
  EXPECT_THAT(blocks(), HasSubstr("cordillera_tile_wait_seconds_count{outcome=\"made\"} 12\n"));
}

TEST_F(LazyWait, AStandInIsGivenAtOnceAndTheFinalTileToWhoPrefersToWait) {
  const std::string id = paused(), path = of_block_level(id);
  const std::string stand_in = whole(id, path, "-H 'Prefer: wait=0'");
  EXPECT_THAT(stand_in, HasSubstr("Cordillera-Provisional: true"));
  EXPECT_THAT(stand_in, Not(HasSubstr("Preference-Applied: ")));
  const std::string final_one = whole(id, path, "-H 'Prefer: wait'");
  EXPECT_THAT(final_one, AllOf(HasSubstr("200 OK"), HasSubstr("Preference-Applied: wait=600"), HasSubstr("ETag: "),
                               Not(HasSubstr("Provisional: true"))))
      << server_.log();
  EXPECT_NE(hash_of(stand_in), hash_of(final_one));
}

TEST_F(LazyWait, HeightsWaitForTheirBlocks) {
  const std::string full = posted("&error=8&max_level=" + std::to_string(kFinest));
  ASSERT_TRUE(is_ready(full)) << server_.log();
  const std::string id = paused();
  const auto points = [&](const std::string& dataset, const std::string& how) {
    return curl(how + server_.base() + "/v1/datasets/" + dataset + "/elevation")["points"];
  };
  const std::string posted_places =
      "-H 'Prefer: wait' -H 'Content-Type: application/json' -d '{\"points\": [[10.05, 46.05], [10.27, 46.27]]}' ";
  EXPECT_EQ(points(id, posted_places), points(full, posted_places)) << server_.log();
  const auto line = [&](const std::string& dataset) {
    return curl("-H 'Prefer: wait' '" + server_.base() + "/v1/datasets/" + dataset +
                "/elevation?line=10.03,46.03;10.29,46.03&samples=20'")["points"];
  };
  EXPECT_EQ(line(id), line(full)) << server_.log();
}

TEST_F(LazyWait, MeshesHaveTheirBlocksMade) {
  const std::string full = posted("&error=8&max_level=" + std::to_string(kFinest));
  ASSERT_TRUE(is_ready(full)) << server_.log();
  const std::string id = paused(), finest_level = std::to_string(kFinest);
  const std::string level = "/mesh.ply?level=" + finest_level, part = level + "&bbox=10.04,46.04,10.09,46.08";
  const std::string made = whole(id, part), wanted = whole(full, part);
  EXPECT_THAT(made, AllOf(HasSubstr("200 OK"), Not(HasSubstr("Provisional: true")))) << server_.log();
  EXPECT_EQ(hash_of(made), hash_of(wanted));
  EXPECT_EQ(line_of(made, "ETag: "), line_of(wanted, "ETag: "));
  // Of the whole level the origin is in the middle of what is known of the bounds by then.
  const auto counts = [&](const std::string& dataset) {
    return shell("curl -q -s -m 500 '" + server_.base() + "/v1/datasets/" + dataset + level +
                 "' | head -c 2000 | grep -a '^element'")
        .output;
  };
  EXPECT_THAT(counts(id), HasSubstr("element face ")) << server_.log();
  EXPECT_EQ(counts(id), counts(full));
}

TEST_F(LazyWait, MeshesOfLevelsAboveBlocksNeedAllOfThem) {
  const std::string id = paused();
  const int above = get(id, "/manifest.json")["done_blocks"]["level"].get<int>() - 1;
  for (const std::string& part :
       {std::string(), "?level=" + std::to_string(above), std::string("?bbox=10.04,46.04,10.09,46.08")}) {
    EXPECT_EQ(get(id, "/mesh.glb" + part)["type"], "urn:cordillera:problem:dataset-not-ready") << part;
  }
}

TEST_F(LazyWait, TheOperatorsLimitEndsTheWait) {
  restart_with_limit("1");
  EXPECT_EQ(curl(server_.base() + "/v1/limits")["limits"]["max_wait"]["value"], 1);
  const std::string id = paused();
  // The one job that may run is another dataset's, and stands still.
  const std::string other = posted();
  const int held = server_.child_process();
  ASSERT_EQ(kill(held, SIGSTOP), 0);
  const std::string late = whole(id, finest(0), "-H 'Prefer: wait=500'");
  EXPECT_THAT(late, AllOf(HasSubstr("503"), HasSubstr("Retry-After: "), HasSubstr("Preference-Applied: wait=1")))
      << server_.log();
  EXPECT_EQ(get(id, finest(0))["type"], "urn:cordillera:problem:tile-not-ready");
  EXPECT_EQ(kill(held, SIGCONT), 0);
  EXPECT_TRUE(eventually([&] { return is_there(id, finest(0)); })) << server_.log();
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
