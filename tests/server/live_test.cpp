// What can be read of a dataset while its build goes on: provisional tiles at the addresses of the final ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>

#include "front_fixture.h"
#include "program_fixture.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {
namespace {

using testing::AllOf;
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
  EXPECT_THAT(
      rest,
      HasSubstr(
          "event: tiles\ndata: "
          "{\"provisional\":false,\"levels\":[{\"level\":0,\"x\":[0,0],\"y\":[0,0]},{\"level\":1,\"x\":[1,1],\"y\":[1,1]}],"));
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
  EXPECT_TRUE(eventually([&] {
    return test_.service().metrics().text().find("cordillera_first_tile_seconds_count{kind=\"final\"} 1") != std::string::npos;
  }));
}

TEST(LiveBlocks, ALookCountsWhereABlockIsToBeMade) {
  proto::Manifest shown;
  for (const double value : {170.0, -10.0, -170.0, 10.0, 0.0, 100.0}) shown.add_bounds(value);  // across the antimeridian
  EXPECT_TRUE(waits_for_block(shown, {5, 0, 0})) << "nobody knows yet where blocks lie";
  shown.mutable_done_blocks()->set_level(5);
  shown.mutable_done_blocks()->add_x(0);
  shown.mutable_done_blocks()->add_y(16);
  const int last = 63;  // column of level 5
  EXPECT_TRUE(waits_for_block(shown, {5, last, 16}));
  EXPECT_TRUE(waits_for_block(shown, {5, 1, 15}));
  EXPECT_TRUE(waits_for_block(shown, {7, 4 * last + 3, 4 * 16}));
  EXPECT_FALSE(waits_for_block(shown, {5, 0, 16})) << "it is done";
  EXPECT_TRUE(is_in_done_block(shown, {6, 1, 33}));
  EXPECT_FALSE(waits_for_block(shown, {6, 1, 33})) << "within one that is done";
  EXPECT_FALSE(waits_for_block(shown, {5, 32, 16})) << "the other side of the earth";
  EXPECT_FALSE(waits_for_block(shown, {5, last, 20})) << "north of the data";
  EXPECT_FALSE(waits_for_block(shown, {4, 31, 8})) << "above the blocks";
}

/// Of lazy datasets, and of full ones where the client prefers to wait. Their jobs build until they are told to go.
class LiveWait : public Live {
 protected:
  using Headers = std::map<std::string, std::string>;
  /// A tile that is not there before the build is done.
  static constexpr const char* kFine = "/tiles/1/1/1.drc";
  static Headers prefer(const char* what) { return {{"prefer", what}}; }
  int waiting() { return test_.service().waiting(Service::WaitsFor::tiles); }
  bool counts(const std::string& outcome, int times) {
    const std::string text = test_.service().metrics().text();
    return text.find("cordillera_tile_wait_seconds_count{outcome=\"" + outcome + "\"} " + std::to_string(times) + "\n") !=
           std::string::npos;
  }
};

TEST_F(LiveWait, AFineTileOfALazyDatasetIsWaitedFor) {
  const std::string id = posted({{"build", "lazy"}});
  Response answer = test_.get(at(id, kFine));
  ASSERT_TRUE(answer.later);
  EXPECT_EQ(waiting(), 1);
  EXPECT_FALSE(answer.later(Patience::more).has_value());
  tell_job(id, "go");
  answer = TestService::settled(std::move(answer));
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(answer.body, "drc of 1");
  EXPECT_EQ(answer.header("Cordillera-Provisional"), "");
  EXPECT_EQ(answer.header("Cache-Control"), "public, no-cache");
  EXPECT_EQ(answer.header("Preference-Applied"), "") << "it stated none";
  ASSERT_TRUE(reaches(id, "ready"));
  EXPECT_EQ(answer.header("ETag"), test_.get(at(id, kFine)).header("ETag"));
  EXPECT_EQ(waiting(), 0);
  EXPECT_TRUE(counts("made", 1)) << test_.service().metrics().text();
}

TEST_F(LiveWait, AFinestTileIsAnsweredBeforeItsBlockIsDone) {
  const std::string id = posted({{"build", "lazy"}}), glb = "/tiles/1/1/1.glb";
  const Layout& layout = test_.service().layout();
  std::filesystem::remove(layout.provisional(id));
  make_store(layout.provisional(id).string(), id, true, 0);
  test_.service().library().forget(id);
  Response answer = test_.get(at(id, kFine));
  ASSERT_TRUE(answer.later);
  EXPECT_FALSE(answer.later(Patience::more).has_value());
  make_store(layout.finest(id, {0, 0, 0}).string(), id);
  test_.service().library().forget(id);  // as when its job tells of it
  answer = TestService::settled(std::move(answer));
  EXPECT_EQ(answer.body, "drc of 1");
  EXPECT_EQ(answer.header("Cordillera-Provisional"), "");
  EXPECT_EQ(answer.header("Cache-Control"), "public, no-cache");
  EXPECT_TRUE(counts("made", 1));
  EXPECT_EQ(test_.get(at(id, glb), prefer("wait=0")).body, "glb of 1") << "who does not want to wait gets it, too";
  EXPECT_EQ(test_.get(at(id, kFine), {{"if-none-match", answer.header("ETag")}}).status, 304);
  EXPECT_EQ(test_.get(at(id, "/tiles/0/0/0.drc"), prefer("wait=0")).body, "provisional drc of 0") << "the block is not done";
  EXPECT_EQ(test_.get(at(id, "/tiles/1/2/0.drc"), prefer("wait=0")).status, 404) << "beside the data";
  Request textured;
  textured.path = at(id, glb);
  textured.query = {{"normals", "texture"}};
  textured.headers = prefer("wait=0");
  EXPECT_EQ(slug_of(test_.api().handle(textured)), "tile-not-ready") << "made of other tiles, too";
  tell_job(id, "go");
  ASSERT_TRUE(reaches(id, "ready"));
  EXPECT_EQ(test_.get(at(id, kFine)).header("ETag"), answer.header("ETag"));
}

TEST_F(LiveWait, WhenTheTimeIsOverItIsToldWhenToComeAgain) {
  const std::string id = posted({{"build", "lazy"}});
  Response answer = TestService::settled(test_.get(at(id, kFine), prefer("wait=1")));
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(slug_of(answer), "tile-not-ready");
  const auto said = std::count_if(answer.headers.begin(), answer.headers.end(),
                                  [](const auto& header) { return header.first == "Retry-After"; });
  EXPECT_EQ(said, 1) << "twice is none";
  EXPECT_EQ(answer.header("Retry-After"), "2");
  EXPECT_EQ(answer.header("Preference-Applied"), "wait=1");
  EXPECT_THAT(answer.header("Cache-Control"), HasSubstr("no-store"));
  EXPECT_EQ(waiting(), 0);
  EXPECT_TRUE(counts("timeout", 1)) << test_.service().metrics().text();
  answer = test_.get(at(id, kFine), prefer("wait=0"));
  EXPECT_EQ(answer.status, 503) << "who does not want to wait is answered at once";
  EXPECT_EQ(slug_of(answer), "tile-not-ready");
  EXPECT_EQ(slug_of(test_.get(at(id, kFine), prefer("wait=soon"))), "option-invalid");
}

TEST_F(LiveWait, WhatPrefersSomethingElseOrIsNoTileIsAnsweredAtOnce) {
  const std::string lazy = posted({{"build", "lazy"}});
  for (const char* path : {"/tileset.json", "/layer.json", "/manifest.json", "/subtrees/W/0/0/0.subtree"}) {
    EXPECT_EQ(test_.get(at(lazy, path), prefer("wait=5")).status, 200) << path << " says what there is";
  }
  EXPECT_EQ(test_.get(at(lazy, "/tiles/0/0/0.drc"), prefer("wait=5")).body, "provisional drc of 0")
      << "no look makes the coarsest";
  EXPECT_EQ(test_.get(at(lazy, "/tiles/1/9/9.drc"), prefer("wait=5")).status, 404) << "outside of the grid";
  const std::string full = posted();
  for (const char* other : {"respond-async", "await=5", "handling=lenient; wait=5", "wait=0"})
    EXPECT_EQ(test_.get(at(full, kFine), prefer(other)).status, 404) << other;
}

TEST_F(LiveWait, WhoLeavesFreesThePlace) {
  const std::string id = posted({{"build", "lazy"}});
  {
    const Response answer = test_.get(at(id, kFine));
    EXPECT_EQ(waiting(), 1);
    EXPECT_EQ(answer.later(Patience::none).value().status, 503);
  }
  EXPECT_EQ(waiting(), 0);
  EXPECT_TRUE(counts("left", 1)) << test_.service().metrics().text();
}

TEST_F(LiveWait, SoManyWaitAndNoMore) {
  const std::string id = posted({{"build", "lazy"}});
  std::vector<Response> all;
  for (int k = 0; k < kMostWaitingForTiles; ++k) all.push_back(test_.get(at(id, kFine)));
  EXPECT_EQ(waiting(), kMostWaitingForTiles);
  const Response beyond = test_.get(at(id, kFine));
  EXPECT_FALSE(beyond.later);
  EXPECT_EQ(beyond.status, 503);
  EXPECT_NE(beyond.header("Retry-After"), "");
  EXPECT_TRUE(counts("refused", 1));
  EXPECT_TRUE(test_.get(at(id, "/events")).next_piece) << "who waits for tiles takes no place of another kind";
  EXPECT_EQ(body_of(test_.get("/v1/limits"))["in_use"]["waiting_for_tiles"], kMostWaitingForTiles);
  tell_job(id, "go");
  for (Response& one : all) EXPECT_EQ(TestService::settled(std::move(one)).body, "drc of 1");
  EXPECT_EQ(waiting(), 0);
}

/// How often a file has been put into a folder under this name.
class Renames {
 public:
  Renames(const std::filesystem::path& folder, std::string name) : name_(std::move(name)), queue_(inotify_init1(IN_NONBLOCK)) {
    // Both ends: of events that follow each other and are alike the kernel tells one.
    if (inotify_add_watch(queue_, folder.c_str(), IN_MOVED_FROM | IN_MOVED_TO) < 0) throw std::runtime_error("no inotify");
  }
  ~Renames() { close(queue_); }
  Renames(const Renames&) = delete;
  Renames& operator=(const Renames&) = delete;
  int count() {
    alignas(inotify_event) std::array<char, 4096> bytes{};
    for (ssize_t got = 0; (got = read(queue_, bytes.data(), bytes.size())) > 0;) {
      for (ssize_t at = 0; at < got;) {
        const auto* event = reinterpret_cast<const inotify_event*>(bytes.data() + at);
        if ((event->mask & IN_MOVED_TO) != 0 && event->name == name_) ++count_;
        at += static_cast<ssize_t>(sizeof(inotify_event) + event->len);
      }
    }
    return count_;
  }

 private:
  const std::string name_;
  const int queue_;
  int count_ = 0;
};

/// Each looks at as many places as the job is told of, so that each makes the others' look forgotten.
TEST(LiveWaits, TellTheJobSeldomHoweverMuchChanges) {
  Settings settings;
  settings.serve.limits.wait_seconds = 600;  // longer than the slowest machine takes
  TestService test(settings);
  const std::string id = id_of(test.post("LIVE", {{"build", "lazy"}})), address = "/v1/datasets/" + id;
  ASSERT_TRUE(eventually([&] { return body_of(test.get(address))["provisional"] == true; }));
  Renames told(test.data() / "datasets" / id, "looked-at");
  std::vector<Response> all;
  for (int k = 0; k < 4; ++k) {
    Request request;
    request.path = address + "/elevation";
    request.headers = {{"prefer", "wait=600"}};
    std::string places;
    for (int n = 0; n < 64; ++n) {
      places += (n == 0 ? "" : ";") + std::to_string(10 + k * 0.1) + "," + std::to_string(46 + n * 0.001);
    }
    request.query = {{"points", places}};
    all.push_back(test.api().handle(request));
    ASSERT_TRUE(all.back().later) << all.back().body;
  }
  EXPECT_GT(told.count(), 0);
  EXPECT_LE(told.count(), 4) << "once a request";
  const auto began = std::chrono::steady_clock::now();
  constexpr int kChanges = 50;
  for (int change = 0; change < kChanges; ++change) {
    test.service().library().forget("another");
    for (Response& one : all) EXPECT_FALSE(one.later(Patience::more));
  }
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - began).count();
  EXPECT_LE(told.count(), 4 * (seconds + 3)) << "once a second and request, of " << kChanges << " changes";
}

TEST_F(LiveWait, AFullBuildIsWaitedForWhereTheClientPrefersIt) {
  const std::string id = posted();
  EXPECT_EQ(test_.get(at(id, kFine)).status, 404);
  Response answer = test_.get(at(id, kFine), prefer("respond-async, Wait=600; x=1"));
  ASSERT_TRUE(answer.later);
  tell_job(id, "go");
  answer = TestService::settled(std::move(answer));
  EXPECT_EQ(answer.body, "drc of 1");
  EXPECT_EQ(answer.header("Preference-Applied"), "wait=10") << "the operator's limit";
}

TEST_F(LiveWait, BeforeThereIsAnythingToo) {
  const std::string id = id_of(test_.post("LIVE", {{"provisional", "off"}}));
  EXPECT_TRUE(eventually([&] { return test_.service().hub().now(id).progress.has_value(); }));
  EXPECT_EQ(slug_of(test_.get(at(id, kFine))), "dataset-not-ready");
  EXPECT_EQ(slug_of(test_.get(at(id, "/tileset.json"), prefer("wait"))), "dataset-not-ready") << "it is no tile";
  Response answer = test_.get(at(id, kFine), prefer("wait"));
  ASSERT_TRUE(answer.later);
  tell_job(id, "go");
  EXPECT_EQ(TestService::settled(std::move(answer)).body, "drc of 1");
}

TEST_F(LiveWait, AnEndThatIsNoTileIsToldAtOnce) {
  const std::string failing = posted({{"build", "lazy"}});
  Response answer = test_.get(at(failing, kFine));
  tell_job(failing, "fail");
  EXPECT_EQ(slug_of(TestService::settled(std::move(answer))), "dataset-failed");
  const std::string deleted = posted({{"build", "lazy"}});
  answer = test_.get(at(deleted, kFine));
  EXPECT_EQ(test_.send("DELETE", at(deleted)).status, 204);
  EXPECT_EQ(slug_of(TestService::settled(std::move(answer))), "dataset-unknown");
}

/// The same behind the socket: they are parked, and nobody else is slower for it.
TEST(LiveWaitFront, WhoWaitsHoldsNoThreadAndFreesItsPlaceWhenItLeaves) {
  Settings settings;
  settings.serve.limits.wait_seconds = 600;  // longer than the slowest machine takes
  Front front({}, {}, settings);
  TestService& test = front.test();
  const std::string id = id_of(test.post("LIVE", {{"build", "lazy"}})), address = "/v1/datasets/" + id;
  ASSERT_TRUE(eventually([&] { return body_of(test.get(address))["provisional"] == true; }));
  const auto waiting = [&] { return test.service().waiting(Service::WaitsFor::tiles); };
  constexpr int kMany = 40;  // far more than workers
  std::vector<RawClient> askers;
  for (int k = 0; k < kMany; ++k) {
    askers.push_back(front.client());
    askers.back().say(get(address + "/tiles/1/1/1." + (k % 2 == 0 ? "drc" : "glb"), "Connection: close\r\nPrefer: wait=600\r\n"));
  }
  ASSERT_TRUE(eventually([&] { return waiting() == kMany; }));
  EXPECT_THAT(front.answer(get(address + "/tiles/0/0/0.glb", "Connection: close\r\n")), HasSubstr("200 OK"))
      << "workers are free";
  askers.pop_back();
  ASSERT_TRUE(eventually([&] { return waiting() == kMany - 1; }));
  std::ofstream(test.data() / "datasets" / id / "go") << "now";
  for (RawClient& asker : askers)
    EXPECT_THAT(asker.rest(), AllOf(HasSubstr("200 OK"), HasSubstr("ETag: "), HasSubstr("Preference-Applied: wait=600")));
  EXPECT_EQ(waiting(), 0);
}

}  // namespace
}  // namespace cordillera::server
