// Requests that wait for a tile: how long, how many, and what they are told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>

#include "front_fixture.h"
#include "live_fixture.h"
#include "pipeline/store/mesh_files.h"

namespace cordillera::server {
namespace {

using live_fixture::Live;
using testing::AllOf;
using testing::HasSubstr;

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

/// A picture of no data is no content, and so a zoom that no level covers yet looks as if nothing were there.
TEST_F(LiveWait, APictureOfAFineZoomIsWaitedForToo) {
  const std::string id = posted({{"build", "lazy"}});
  for (const char* path : {"/hillshade/9/200/200.png", "/slope/9/200/200.png", "/contours/9/200/200.mvt"}) {
    EXPECT_EQ(slug_of(test_.get(at(id, path), prefer("wait=0"))), "tile-not-ready") << path;
    EXPECT_TRUE(test_.get(at(id, path)).later) << path;
  }
  EXPECT_EQ(waiting(), 0);
  EXPECT_EQ(test_.get(at(posted(), "/hillshade/9/200/200.png")).status, 204) << "of a full build, where that is preferred";
}

/// A finer step of provisional tiles, in place of the first.
void make_finer_step(const std::string& path, const std::string& id) {
  proto::Plan plan;
  plan.set_finest_level(1);
  for (const std::uint32_t level : {1u, 0u}) plan.add_levels()->set_level(level);
  pipeline::FinishedTask task;
  task.tiles = {test_tile(1, 1, 1), test_tile(0, 0, 0)};
  task.tiles[0].drc = "provisional drc of 1";
  proto::Manifest manifest;
  manifest.set_id(id);
  manifest.set_max_level(1);
  manifest.set_provisional(true);
  pipeline::remove_store(path);
  auto writer = pipeline::StoreWriter::open(path, plan);
  ASSERT_TRUE(writer.ok() && (*writer)->commit(task).ok() && (*writer)->publish(manifest).ok());
}

TEST(LiveWaits, EndWithAProvisionalTileForWhoNamesNoTime) {
  Settings settings;
  settings.serve.limits.wait_seconds = 600;  // longer than the slowest machine takes
  TestService test(settings);
  const std::string id = id_of(test.post("LIVE", {{"build", "lazy"}})), address = "/v1/datasets/" + id,
                    tile = address + "/tiles/1/1/1.drc";
  ASSERT_TRUE(eventually([&] { return body_of(test.get(address))["provisional"] == true; }));
  Response any = test.get(tile), final = test.get(tile, {{"prefer", "wait=600"}});
  ASSERT_TRUE(any.later && final.later);
  make_finer_step(test.service().layout().provisional(id).string(), id);
  test.service().library().forget(id);  // as when its job tells of it
  std::optional<Response> come = any.later(Patience::more);
  ASSERT_TRUE(come && come->rest);
  any = TestService::plain(come->rest());
  EXPECT_EQ(any.body, "provisional drc of 1");
  EXPECT_EQ(any.header("Cordillera-Provisional"), "true");
  EXPECT_FALSE(final.later(Patience::more).has_value()) << "who names a time wants the final one";
  std::ofstream(test.data() / "datasets" / id / "go") << "now";
  EXPECT_EQ(TestService::settled(std::move(final)).body, "drc of 1");
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
  for (const char* other : {"respond-async", "await=5", "handling=lenient; wait=5", "wait=0", "wait=soon", "wait=", "wait=-1"})
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
  Response answer = test_.get(at(id, kFine), prefer("respond-async, Wait=6000000000; x=1"));
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
