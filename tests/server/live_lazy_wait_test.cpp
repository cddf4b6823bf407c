// Whoever waits for what a lazy dataset does not have yet, with the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "live_program_fixture.h"
#include "raw_client.h"

namespace cordillera::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

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
  /// Its levels are known, and none of its blocks is made.
  std::string unmade() {
    const std::string id = posted(lazy_);
    EXPECT_TRUE(eventually([&] { return get(id, "/manifest.json")["done_blocks"].is_object(); })) << server_.log();
    return id;
  }
  /// And its job has ended.
  std::string paused() {
    const std::string id = unmade();
    EXPECT_TRUE(eventually([&] { return server_.log().find("outcome=paused") != std::string::npos; })) << server_.log();
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
  const std::string id = unmade(), path = of_block_level(id);
  const std::string stand_in = whole(id, path, "-H 'Prefer: wait=0'");
  EXPECT_THAT(stand_in, HasSubstr("Cordillera-Provisional: true"));
  EXPECT_THAT(stand_in, Not(HasSubstr("Preference-Applied: ")));
  const std::string final_one = whole(id, path, "-H 'Prefer: wait'");
  EXPECT_THAT(final_one, AllOf(HasSubstr("200 OK"), HasSubstr("Preference-Applied: wait=600"), HasSubstr("ETag: "),
                               Not(HasSubstr("Provisional: true"))))
      << server_.log();
  EXPECT_NE(hash_of(stand_in), hash_of(final_one));
}

TEST_F(LazyWait, FetchTakesFinalTilesAndSaysWhichAreNone) {
  const std::string id = unmade(), path = of_block_level(id), file = (folder_.path() / "tile.drc").string();
  const int level = get(id, "/manifest.json")["done_blocks"]["level"];
  const auto fetch = [&](const std::string& address) {
    return Json::parse(shell(kProgram + " fetch --json -q --server " + server_.base() + " -o " + file + " " + id + " " +
                             address.substr(std::string("/tiles/").size()))
                           .output,
                       nullptr, false);
  };
  EXPECT_EQ(fetch(path)["provisional"], 0) << server_.log();
  EXPECT_EQ(file_text(file), shell("curl -q -s " + server_.base() + "/v1/datasets/" + id + path).output);
  EXPECT_EQ(fetch(middle(level - 1))["provisional"], 1) << "above its blocks nothing is final yet";
}

TEST_F(LazyWait, HeightsWaitForTheirBlocks) {
  const std::string full = posted("&error=8&max_level=" + std::to_string(kFinest));
  ASSERT_TRUE(is_ready(full)) << server_.log();
  const std::string id = unmade();
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
  const std::string id = unmade(), finest_level = std::to_string(kFinest);
  const std::string level = "/mesh.ply?level=" + finest_level, part = level + "&bbox=10.04,46.04,10.09,46.08";
  EXPECT_THAT(whole(id, "/mesh.ply?level=99"), HasSubstr("HTTP/1.1 400")) << "and nothing is built for it";
  const std::string made = whole(id, part), wanted = whole(full, part);
  EXPECT_THAT(made, AllOf(HasSubstr("200 OK"), Not(HasSubstr("Provisional: true")))) << server_.log();
  EXPECT_EQ(hash_of(made), hash_of(wanted));
  EXPECT_EQ(line_of(made, "ETag: "), line_of(wanted, "ETag: "));
  const std::string box = part.substr(0, part.find('?') + 1) + part.substr(part.find("bbox"));
  EXPECT_EQ(hash_of(whole(id, box)), hash_of(whole(full, box))) << "without a level, of that of the blocks";
  EXPECT_EQ(status(id)["state"], "running") << "a box is not all";
  // Of the whole level the origin is in the middle of what is known of the bounds by then.
  const auto counts = [&](const std::string& dataset) {
    return shell("curl -q -s -m 500 '" + server_.base() + "/v1/datasets/" + dataset + level +
                 "' | head -c 2000 | grep -a '^element'")
        .output;
  };
  EXPECT_THAT(counts(id), HasSubstr("element face ")) << server_.log();
  EXPECT_EQ(counts(id), counts(full));
  const std::string above = "/mesh.ply?level=" + get(full, "/manifest.json")["min_level"].dump(), all = whole(id, above);
  EXPECT_THAT(all, AllOf(HasSubstr("200 OK"), Not(HasSubstr("Provisional: true")))) << server_.log();
  EXPECT_EQ(hash_of(all), hash_of(whole(full, above)));
  EXPECT_EQ(status(id)["state"], "ready");
}

TEST_F(LazyWait, WhoDoesNotWaitForTheWholeIsToldHowMuchIsMade) {
  restart_with_limit("0");
  const std::string id = unmade(), path = server_.base() + "/v1/datasets/" + id + ".pmtiles";
  const std::string said = shell("curl -q -s -D - '" + path + "'").output;
  EXPECT_THAT(said, AllOf(HasSubstr("503"), HasSubstr("Retry-After: "), HasSubstr("tile-not-ready"),
                          HasSubstr(" % of the dataset is built")));
  EXPECT_TRUE(eventually([&] { return shell("curl -q -s -o /dev/null -w '%{http_code}' '" + path + "'").output == "200"; }))
      << server_.log();
}

TEST_F(LazyWait, AFullBuildIsWaitedForByWhoSaysSo) {
  const std::string id = posted();
  const int held = server_.child_process();
  ASSERT_EQ(kill(held, SIGSTOP), 0);
  EXPECT_THAT(whole(id, ".pmtiles"), HasSubstr("409"));
  EXPECT_THAT(whole(id, ".pmtiles", "-H 'Prefer: wait=1'"), AllOf(HasSubstr("503"), HasSubstr("Preference-Applied: wait=1")));
  EXPECT_EQ(kill(held, SIGCONT), 0);
  EXPECT_THAT(whole(id, ".pmtiles", "-H 'Prefer: wait'"), HasSubstr("200 OK")) << server_.log();
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

}  // namespace
}  // namespace cordillera::server
