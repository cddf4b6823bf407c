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

TEST_F(LiveWait, WhenTheTimeIsOverItIsToldWhenToComeAgain) {
  const std::string id = posted({{"build", "lazy"}});
  Response answer = TestService::settled(test_.get(at(id, kFine), prefer("wait=1")));
  EXPECT_EQ(answer.status, 503);
  EXPECT_EQ(slug_of(answer), "tile-not-ready");
  const auto said = std::count_if(answer.headers.begin(), answer.headers.end(), [](const auto& header) { return header.first == "Retry-After"; });
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
  std::string head(const std::string& id, const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -m 500 -D - -o /dev/null " + more + server_.base() + "/v1/datasets/" + id + path).output;
  }
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
  const Json done = get(id, "/manifest.json")["done_blocks"];
  EXPECT_EQ(done["x"].size(), 1u) << done;
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
