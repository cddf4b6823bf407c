// What becomes of jobs, seen by the API: failures, limits, keys, deletions, restarts, events.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "fixture.h"

namespace cordillera::server {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(Api, AFailedBuildIsAProblem) {
  TestService test;
  const Response posted = test.post("BAD", {{"name", "photo.png"}}, kWait);
  EXPECT_EQ(posted.status, 422);
  EXPECT_EQ(slug_of(posted), "raster-unreadable");
  const Json list = body_of(test.get("/v1/datasets"))["datasets"];
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0]["state"], "failed");
  EXPECT_THAT(std::string(list[0]["error"]["detail"]), HasSubstr("photo.png"));
  const std::string base = "/v1/datasets/" + std::string(list[0]["id"]);
  EXPECT_EQ(test.get(base + "/tiles/0/0/0.drc").status, 409);
  EXPECT_EQ(test.send("DELETE", base).status, 204);
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(Api, ACrashedChildHarmsNobodyElse) {
  TestService test;
  const Response posted = test.post("CRASH", {}, kWait);
  EXPECT_EQ(posted.status, 500);
  EXPECT_EQ(slug_of(posted), "job-crashed");
  EXPECT_EQ(test.post("GOOD", {}, kWait).status, 201);
}

TEST(Api, ALostGpuMeansTheCpu) {
  TestService test;
  EXPECT_EQ(test.post("LOST", {}, kWait).status, 201);
}

TEST(Api, BadRequestsLeaveNothing) {
  TestService test;
  EXPECT_EQ(slug_of(test.post("")), "body-empty");
  const Response unknown = test.post("GOOD", {{"eror", "1"}});
  EXPECT_EQ(slug_of(unknown), "option-unknown");
  EXPECT_THAT(body_of(unknown)["accepted"], AllOf(HasSubstr(", water, "), Not(HasSubstr("water_mask")))) << "which is refused";
  EXPECT_FALSE(body_of(test.get("/v1"))["options"].contains("water_mask"));
  EXPECT_EQ(body_of(test.post("GOOD", {{"error", "x"}}))["parameter"], "error");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-type", "multipart/form-data"}})), "form-invalid") << "without a boundary";
  EXPECT_EQ(test.post("GOOD", {}, {{"content-type", "multipart/mixed; boundary=x"}}).status, 415);
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-type", "multipart/form-data; boundary=x"}})), "body-incomplete");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-length", "9"}})), "body-incomplete");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-length", "-9"}})), "request-invalid");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"vertical_datum", "/etc/passwd"}})), "option-forbidden");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"crs", "/etc/passwd"}})), "option-forbidden");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"water_mask", "sea.tif"}})), "option-forbidden");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"crs", "+proj=longlat +nadgrids=/etc/passwd"}})), "option-forbidden");
  EXPECT_EQ(test.leftovers(), 0u);
  EXPECT_TRUE(body_of(test.get("/v1/datasets"))["datasets"].empty());
}

TEST(Api, AWaitThatIsNoNumberIsIgnored) {
  TestService test;
  for (const char* other : {"wait=soon", "wait=-1", "wait=", "wait=300s", "wait=5abc", "wait=2.5", "wait=\"5"}) {
    const Response posted = test.post("GOOD", {}, {{"prefer", other}});
    EXPECT_EQ(posted.status, 202) << other << ": " << posted.body;
    EXPECT_EQ(posted.header("Preference-Applied"), "") << other;
  }
}

TEST(Api, ABodyBeyondTheLimitIsRefused) {
  Settings settings;
  settings.serve.limits.body_mib = 1;
  TestService test(settings);
  const std::string large(std::size_t{1} << 20 | 1, 'x');
  EXPECT_EQ(test.post(large).status, 413);
  Request chunked;
  chunked.method = "POST";
  chunked.path = "/v1/datasets";
  chunked.headers = {{"transfer-encoding", "chunked"}};
  chunked.read_body = [&](const Request::Sink& sink) { return sink(large); };
  EXPECT_EQ(test.api().handle(chunked).status, 413);
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(Api, ADryRunBuildsNothing) {
  TestService test;
  const Response answer = test.post("GOOD", {{"dry_run", "1"}});
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(body_of(answer)["manifest"]["tiles"], 99);
  EXPECT_EQ(body_of(answer)["seconds"], 12.0);
  const Json manifest = body_of(answer)["manifest"];
  EXPECT_EQ(manifest["source"]["columns"], 7);
  EXPECT_EQ(manifest["levels"][0]["target"], 3.0);
  for (const char* name : {"stated_max_error", "rmse", "geometric_error", "uncovered_samples"}) {
    EXPECT_FALSE(manifest["levels"][0].contains(name)) << name << " is not known before a build";
  }
  for (const char* name : {"nodata_share", "min_height", "error_at_pixels"})
    EXPECT_FALSE(manifest["source"].contains(name)) << name;
  const Json shares = body_of(test.post("GOOD", {{"dry_run", "1"}, {"keep", "0.5"}}))["manifest"]["levels"][0];
  EXPECT_FALSE(shares.contains("target")) << "the tolerance behind a share is found when it is built";
  EXPECT_EQ(test.post("BAD", {{"dry_run", "1"}}).status, 422);
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(Api, ADryRunThatTheEndOfTheServiceStopsSaysSo) {
  TestService test;
  Response answer;
  std::thread client([&] { answer = test.post("SLOW", {{"dry_run", "1"}}); });
  EXPECT_TRUE(eventually([&] { return test.leftovers() == 3; })) << "a folder with a raster and a job";
  test.service().stop();
  client.join();
  EXPECT_EQ(slug_of(answer), "service-stopping");
}

TEST(Api, SomebodyElsesFolderIsLeftAlone) {
  const TempFolder folder;
  Settings settings;
  settings.serve.data = (folder.path() / "data").string();
  std::filesystem::create_directories(folder.path() / "data" / "datasets" / "theirs");
  const auto opened = Service::open(settings, play_job);
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.problem().type, "data-unusable");
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "data" / "datasets" / "theirs"));
  settings.serve.data = (folder.path() / "new").string();
  std::filesystem::create_directories(folder.path() / "new" / "incoming");
  EXPECT_TRUE(Service::open(settings, play_job)) << "what a first start left behind is ours";
  EXPECT_TRUE(Service::open(settings, play_job)) << "and so is what an earlier server made";
}

TEST(Api, AFolderThatCannotBeWrittenIsUsedByNobodyElse) {
  const TempFolder folder;
  Settings settings;
  settings.serve.data = folder.path().string();
  std::filesystem::create_directories(Layout{folder.path()}.lock());  // no user may write a folder as a file
  const auto opened = Service::open(settings, play_job);
  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.problem().detail, HasSubstr(": it cannot be written: Is a directory"));
}

TEST(Api, TheSameKeyGivesTheSameDataset) {
  TestService test;
  const std::map<std::string, std::string> key = {{"idempotency-key", "k1"}, {"prefer", "wait=200"}};
  const Response first = test.post("GOOD", {{"error", "1"}}, key);
  const Response again = test.post("GOOD", {{"error", "1"}}, key);
  EXPECT_EQ(again.status, 201);
  EXPECT_EQ(posted_id(again), posted_id(first));
  EXPECT_EQ(slug_of(test.post("GOOD", {{"error", "2"}}, key)), "idempotency-key-reused");
  EXPECT_EQ(slug_of(test.post("GOOD2", {{"error", "1"}}, key)), "idempotency-key-reused");
  EXPECT_EQ(body_of(test.get("/v1/datasets"))["datasets"].size(), 1u);
  const auto held = test.service().key_token("", "k2");
  EXPECT_EQ(test.post("GOOD", {}, {{"idempotency-key", "k2"}}).status, 409);
}

TEST(Api, DeletingEndsARunningBuild) {
  TestService test;
  const Response posted = test.post("SLOW");
  ASSERT_EQ(posted.status, 202);
  const std::string path = "/v1/datasets/" + posted_id(posted);
  EXPECT_TRUE(eventually([&] { return body_of(test.get(path))["progress"]["share"] > 0; }));
  EXPECT_EQ(body_of(test.get(path))["state"], "running");
  EXPECT_EQ(body_of(test.get(path))["progress"]["share"], 0.325) << "three tenths of the blocks, which are three quarters of all";
  const Response tile = test.get(path + "/tiles/0/0/0.drc");
  EXPECT_EQ(tile.status, 409);
  const std::string queued = posted_id(test.post("GOOD"));
  EXPECT_EQ(body_of(test.get("/v1/datasets/" + queued))["state"], "queued");
  EXPECT_EQ(test.send("DELETE", path).status, 204);
  EXPECT_EQ(test.get(path).status, 404);
  EXPECT_EQ(test.send("DELETE", path).status, 404);
  EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + queued).status, 204);
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(Api, ARestartTakesUpWhatWasUnfinished) {
  TestService test;
  const std::string slow = posted_id(test.post("SLOW"));
  const std::string good = posted_id(test.post("GOOD"));
  test.stop();
  std::filesystem::create_directories(test.data() / "incoming" / "half");
  std::filesystem::create_directories(test.data() / "datasets" / "orphan");
  std::ofstream(test.data() / "datasets" / slow / "source") << "GOOD";
  test.start();
  EXPECT_TRUE(eventually([&] { return body_of(test.get("/v1/datasets/" + good))["state"] == "ready"; }));
  EXPECT_EQ(body_of(test.get("/v1/datasets/" + slow))["state"], "ready");
  EXPECT_EQ(body_of(test.get("/v1/datasets/" + good))["state"], "ready");
  EXPECT_FALSE(std::filesystem::exists(test.data() / "incoming" / "half"));
  EXPECT_FALSE(std::filesystem::exists(test.data() / "datasets" / "orphan"));
}

TEST(Api, TwoServersDoNotShareAFolder) {
  TestService test;
  const auto second = Service::open(test.settings(), play_job);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.problem().type, "data-unusable");
}

TEST(Api, EventsTellProgressAndTheEnd) {
  TestService test;
  const std::string id = posted_id(test.post("SLOW"));
  EXPECT_TRUE(eventually([&] { return test.service().hub().now(id).progress.has_value(); }));
  Response stream = test.get("/v1/datasets/" + id + "/events");
  ASSERT_EQ(stream.header("Content-Type"), "text/event-stream");
  const std::string first = stream.next_piece().value_or("");
  EXPECT_THAT(first, HasSubstr("event: progress\ndata: {\"stage\":\"build\",\"done\":3,\"total\":10,"));
  EXPECT_THAT(first, HasSubstr("\"seconds_left\":7,"));
  const std::string behind = posted_id(test.post("SLOW too"));
  EXPECT_EQ(
      test.get("/v1/datasets/" + behind + "/events").next_piece().value_or(""),
      "event: progress\ndata: "
      "{\"stage\":\"queued\",\"done\":0,\"total\":0,\"share\":0,\"seconds_left\":null,\"place\":1,\"state\":\"queued\"}\n\n");
  test.service().queue().enqueue(id, "");  // as a change does of a dataset that is being built
  EXPECT_EQ(test.get("/v1/datasets/" + id + "/events").next_piece().value_or(""), first) << "it waits for its own build alone";
  test.send("DELETE", "/v1/datasets/" + behind);
  test.send("DELETE", "/v1/datasets/" + id);
  std::string last;
  while (auto piece = stream.next_piece()) last = *piece;
  EXPECT_THAT(last, HasSubstr("event: failed"));

  const std::string good = posted_id(test.post("GOOD", {}, kWait));
  Response done = test.get("/v1/datasets/" + good + "/events");
  const std::string ready = done.next_piece().value_or("");
  EXPECT_THAT(ready, HasSubstr("event: ready"));
  EXPECT_FALSE(done.next_piece());
  // An EventSource asks again when a stream has ended; 204 ends that.
  const auto id_in = [](const std::string& event) {
    const std::size_t at = event.find("\nid: ") + 5;
    return event.substr(at, event.find('\n', at) - at);
  };
  ASSERT_THAT(ready, HasSubstr("\nid: "));
  const std::map<std::string, std::string> seen = {{"last-event-id", id_in(ready)}};
  EXPECT_EQ(test.get("/v1/datasets/" + good + "/events", seen).status, 204);
  EXPECT_EQ(test.get("/v1/datasets/" + good + "/events", {{"last-event-id", "another"}}).status, 200);
  Request titled;
  titled.method = "PATCH";
  titled.path = "/v1/datasets/" + good;
  titled.query = {{"title", "Hills"}};
  EXPECT_EQ(test.api().handle(titled).status, 200);
  EXPECT_THAT(test.get("/v1/datasets/" + good + "/events", seen).next_piece().value_or(""), HasSubstr("Hills")) << "news";
  const std::string bad = posted_id(test.post("BAD"));
  Response stream_of_bad = test.get("/v1/datasets/" + bad + "/events");
  for (auto piece = stream_of_bad.next_piece(); piece; piece = stream_of_bad.next_piece()) last = piece->empty() ? last : *piece;
  ASSERT_THAT(last, HasSubstr("\nid: "));
  EXPECT_EQ(test.get("/v1/datasets/" + bad + "/events", {{"last-event-id", id_in(last)}}).status, 204);
}

TEST(Api, WaitingClientsAreCounted) {
  TestService test;
  const std::string id = posted_id(test.post("SLOW"));
  std::vector<Response> streams;
  for (int i = 0; i < kMostWaiting; ++i) streams.push_back(test.get("/v1/datasets/" + id + "/events"));
  EXPECT_EQ(test.get("/v1/datasets/" + id + "/events").status, 503);
  streams.clear();
  EXPECT_EQ(test.get("/v1/datasets/" + id + "/events").status, 200);
}

TEST(Api, EveryAnswerMayBeReadFromElsewhere) {
  TestService test;
  for (const char* path : {"/", "/v1", "/nothing", "/v1/nothing", "/healthz", "/readyz"}) {
    EXPECT_EQ(test.get(path).header("Access-Control-Allow-Origin"), "*") << path;
  }
  const Response preflight = test.send("OPTIONS", "/v1/datasets/a/tiles/0/0/0.drc");
  EXPECT_EQ(preflight.status, 204);
  EXPECT_THAT(preflight.header("Access-Control-Allow-Methods"), HasSubstr("GET"));
  EXPECT_EQ(test.send("PATCH", "/v1/datasets").status, 405);
  EXPECT_EQ(test.send("DELETE", "/v1").header("Allow"), "GET, HEAD, OPTIONS");
}

TEST(Api, ThePageNeverLeavesItsFolder) {
  TestService test;
  EXPECT_THAT(test.get("/").body, HasSubstr("viewer is not installed"));
  test.post("GOOD", {{"name", "<script>"}}, kWait);
  EXPECT_THAT(test.get("/").body, HasSubstr("&lt;script&gt;"));
  std::filesystem::create_directories(test.folder() / "web" / "assets");
  std::ofstream(test.folder() / "web" / "index.html") << "viewer";
  std::ofstream(test.folder() / "web" / "assets" / "a.js") << "code";
  std::ofstream(test.folder() / "secret") << "secret";
  std::filesystem::create_symlink(test.folder() / "secret", test.folder() / "web" / "link");
  EXPECT_EQ(test.get("/").body, "viewer");
  EXPECT_EQ(test.get("/assets/a.js").header("Content-Type"), "text/javascript; charset=utf-8");
  for (const char* path : {"/../secret", "/assets/../../secret", "//secret", "/link", "/assets"}) {
    EXPECT_EQ(test.get(path).status, 404) << path;
  }
}

TEST(Api, TheOperatorsLimitsHold) {
  Settings settings;
  settings.build.set_threads(2);
  TestService test(settings);
  const Response posted = test.post("GOOD", {{"vertical_datum", "local.tif"}, {"threads", "50"}, {"memory", "128"}});
  ASSERT_EQ(posted.status, 202);
  const auto dataset = test.service().registry().find(posted_id(posted));
  EXPECT_EQ(dataset->options.vertical_datum(), "local.tif");
  EXPECT_EQ(dataset->options.threads(), 2u);
  EXPECT_EQ(dataset->options.memory(), 128u);
  EXPECT_EQ(test.post("GOOD", {{"vertical_datum", "../local.tif"}}).status, 403);
}

}  // namespace
}  // namespace cordillera::server
