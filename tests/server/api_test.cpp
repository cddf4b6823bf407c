// The API as a function, with played jobs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "fixture.h"
#include "pipeline/tileset/manifest_json.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

const std::map<std::string, std::string> kWait = {{"prefer", "wait=200"}};

std::string posted_id(const Response& response) { return body_of(response)["id"]; }

TEST(Api, APostBecomesTiles) {
  TestService test;
  const Response posted = test.post("GOOD", {{"name", "Alps.tif"}}, kWait);
  ASSERT_EQ(posted.status, 201) << posted.body;
  const std::string id = posted_id(posted);
  EXPECT_EQ(id.rfind("alps-", 0), 0u);
  EXPECT_EQ(posted.header("Location"), "/v1/datasets/" + id);
  EXPECT_EQ(body_of(posted)["links"]["tileset"], "/v1/datasets/" + id + "/tileset.json");

  const std::string base = "/v1/datasets/" + id;
  EXPECT_EQ(body_of(test.get(base))["state"], "ready");
  EXPECT_EQ(body_of(test.get(base))["links"]["manifest"], base + "/manifest.json");
  EXPECT_EQ(body_of(test.get(base))["manifest"]["tiles"], 2);
  EXPECT_EQ(test.get(base + "/tiles/1/1/1.drc").body, "drc of 1");
  EXPECT_EQ(test.get(base + "/tiles/0/0/0.glb").header("Content-Type"), "model/gltf-binary");
  EXPECT_EQ(test.get(base + "/tiles/W/1/1/1.glb").body, "glb of 1");
  EXPECT_EQ(test.get(base + "/manifest.json").status, 200);
  EXPECT_EQ(test.get(base + "/tileset.json").status, 200);
  EXPECT_EQ(test.get(base + "/subtrees/W/0/0/0.subtree").status, 200);
  EXPECT_EQ(test.get(base + "/subtrees/E/1/0/0.subtree").status, 404);
  // It goes after the dataset is said to be ready, so that a crash between the two loses nothing.
  const auto raster = test.data() / "datasets" / id / "source.tif";
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(raster); })) << "a built raster is not kept";
}

TEST(Api, WholeNumbersArePrintedAsSuch) {
  TestService test;
  const std::string base = "/v1/datasets/" + posted_id(test.post("GOOD", {}, kWait));
  for (const std::string& path : {std::string("/v1/datasets"), base, base + "/manifest.json"}) {
    EXPECT_THAT(test.get(path).body, Not(testing::ContainsRegex("[0-9]\\.0[,\n}]"))) << path;
  }
  EXPECT_TRUE(body_of(test.get(base))["manifest"]["bytes"].is_number_integer());
  EXPECT_TRUE(body_of(test.get(base + "/manifest.json"))["levels"][0]["drc_bytes"].is_number_integer());
  EXPECT_THAT(test.post("GOOD", {{"dry_run", "1"}}).body, HasSubstr("\"seconds\": 12,"));
  EXPECT_EQ(plain_numbers({{"a", 0.5}, {"b", {-3.0, 1e300}}}).dump(), R"({"a":0.5,"b":[-3,1e+300]})");
}

TEST(Api, AMisspeltParameterIsToldItsNeighbour) {
  TestService test;
  const Response answer = test.post("GOOD", {{"eror", "5"}});
  EXPECT_EQ(answer.status, 400);
  EXPECT_THAT(std::string(body_of(answer)["detail"]), HasSubstr("did you mean error?"));
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(Api, DocumentsHoldOnlyRelativeAddresses) {
  TestService test;
  const std::string id = posted_id(test.post("GOOD", {}, kWait));
  const std::string base = "/v1/datasets/" + id;
  EXPECT_THAT(test.get(base + "/tileset.json").body, Not(HasSubstr("\"/")));
  for (const std::string& path : {std::string("/v1"), std::string("/v1/datasets"), base, base + "/tileset.json"}) {
    EXPECT_THAT(test.get(path).body, Not(HasSubstr("http://"))) << path;
  }
}

TEST(Api, LinksArePathsBelowThePublicPrefix) {
  TestService test;
  const std::string base = "/v1/datasets/" + posted_id(test.post("GOOD", {}, kWait));
  const std::pair<const char*, const char*> rows[] = {
      {"/terrain", "/terrain"}, {"terrain/", "/terrain"}, {"//example.org", "/example.org"}, {"/a b", ""}, {"/", ""}};
  for (const auto& [told, prefix] : rows) {
    const Json status = body_of(test.get(base, {{"x-forwarded-prefix", told}})),
               list = body_of(test.get("/v1/datasets", {{"x-forwarded-prefix", told}}));
    EXPECT_EQ(status["links"]["self"], prefix + base) << told;
    const Json index = body_of(test.get("/v1", {{"x-forwarded-prefix", told}}))["links"];
    EXPECT_EQ(index["datasets"], prefix + std::string("/v1/datasets")) << told;
    EXPECT_EQ(index["viewer"], prefix + std::string("/")) << told;
    for (const auto& [name, path] : index.items()) {
      const std::string here = path.get<std::string>().substr(std::string(prefix).size());
      EXPECT_TRUE(name == "viewer" || test.get(here).status == 200) << name;
    }
    EXPECT_EQ(status["faces"][0]["href"], prefix + base + "/manifest.json") << told;
    EXPECT_EQ(list["datasets"][0]["links"]["self"], prefix + base) << told << ": the list's texts are kept";
  }
}

std::set<std::string> names_in(const Json& links) {
  std::set<std::string> names;
  for (const auto& [name, link] : links.items()) names.insert(name);
  return names;
}

TEST(Api, AMountedFolderListsWhatLiesInIt) {
  const TempFolder folder;
  const auto put = [&](const std::string& path, const std::string& bytes) {
    std::filesystem::create_directories((folder.path() / path).parent_path());
    std::ofstream(folder.path() / path) << bytes;
  };
  proto::Manifest manifest;
  for (const double side : {-72.0, 44.0, -71.0, 45.0, 0.0, 100.0}) manifest.add_bounds(side);
  put("manifest.json", pipeline::manifest_json(manifest));
  for (const char* path : {"tileset.json", "subtrees/W/0/0/0.subtree", "tiles/W/0/0/0.glb"}) put(path, "{}");
  Settings settings;
  settings.serve.mounts = {{"x", folder.path().string()}};
  TestService test(settings);
  const auto faces = [&](const Json& status) {
    std::string names;
    for (const Json& face : status["faces"]) names += face["name"].get<std::string>() + " ";
    return names;
  };
  const Json status = body_of(test.get("/v1/datasets/x"));
  EXPECT_EQ(names_in(status["links"]), (std::set<std::string>{"self", "events", "manifest", "tileset"}));
  EXPECT_EQ(faces(status), "3d-tiles ");
  EXPECT_EQ(status["faces"][0]["links"].size(), 3u) << "there is no tiles/{z}/{x}/{y}.glb";
  const Json item = body_of(test.get("/stac/collections/datasets/items/x"));
  EXPECT_EQ(names_in(item["assets"]), (std::set<std::string>{"3d-tiles", "manifest"}));
  for (const auto& [name, asset] : item["assets"].items())
    EXPECT_EQ(test.get(asset["href"].get<std::string>()).status, 200) << name;
  EXPECT_EQ(body_of(test.get("/v1/datasets"))["datasets"][0]["links"], status["links"]);
  put("tiles/1/1/1.drc", "a tile");
  EXPECT_EQ(names_in(body_of(test.get("/v1/datasets/x"))["links"]),
            (std::set<std::string>{"self", "events", "manifest", "tileset", "drc"}));
  EXPECT_EQ(faces(body_of(test.get("/v1/datasets/x"))), "drc 3d-tiles ");
}

TEST(Api, UnchangedTilesCostA304) {
  TestService test;
  const std::string tile = "/v1/datasets/" + posted_id(test.post("GOOD", {}, kWait)) + "/tiles/1/1/1.drc";
  const Response first = test.get(tile);
  const std::string etag = first.header("ETag");
  ASSERT_GT(etag.size(), 10u);
  EXPECT_THAT(first.header("Cache-Control"), HasSubstr("no-cache"));
  for (const std::string& tag : {etag, "W/" + etag, "\"other\", " + etag, std::string("*")}) {
    const Response again = test.get(tile, {{"if-none-match", tag}});
    EXPECT_EQ(again.status, 304) << tag;
    EXPECT_EQ(again.header("ETag"), etag);
    EXPECT_TRUE(again.body.empty());
  }
  EXPECT_EQ(test.get(tile, {{"if-none-match", "\"other\""}}).status, 200);
}

TEST(Api, AGlbIsMadeByAWorker) {
  TestService test;
  const auto quick = [&](const std::string& tile) {
    Request request;
    request.method = "GET";
    request.path = "/v1/datasets/alps/tiles/" + tile;
    return test.api().is_quick(request, parse_route(request.path));
  };
  EXPECT_TRUE(quick("1/1/1.drc"));
  EXPECT_FALSE(quick("1/1/1.glb"));
  EXPECT_FALSE(quick("W/1/1/1.glb"));
}

TEST(Api, WhatMayBeCompressedVariesAndHasAWeakTag) {
  TestService test;
  const std::string base = "/v1/datasets/" + posted_id(test.post("GOOD", {}, kWait));
  for (const std::string& path : {base + "/manifest.json", base + "/tileset.json"}) {
    const Response document = test.get(path);
    const std::string etag = document.header("ETag");
    EXPECT_EQ(document.header("Vary"), "Accept-Encoding") << path;
    ASSERT_EQ(etag.substr(0, 3), "W/\"") << path;
    for (const std::string& tag : {etag, etag.substr(2)}) {
      const Response unchanged = test.get(path, {{"if-none-match", tag}});
      EXPECT_EQ(unchanged.status, 304) << path << tag;
      EXPECT_EQ(unchanged.header("Vary"), "Accept-Encoding");
      EXPECT_EQ(unchanged.header("ETag"), etag);
    }
  }
  EXPECT_EQ(test.get(base).header("Vary"), "Accept-Encoding") << "a document without a tag, too";
  const Response tile = test.get(base + "/tiles/1/1/1.drc");
  EXPECT_EQ(tile.header("Vary"), "") << "tiles go as they are";
  EXPECT_EQ(tile.header("ETag").substr(0, 1), "\"");
}

TEST(Api, StatusAndListNameTheAttribution) {
  TestService test;
  const std::string id = posted_id(test.post("GOOD", {}, kWait));
  EXPECT_EQ(body_of(test.get("/v1/datasets/" + id))["manifest"]["attribution"], "Somebody");
  EXPECT_EQ(body_of(test.get("/v1/datasets"))["datasets"][0]["manifest"]["attribution"], "Somebody");
}

TEST(Api, TheListIsPrintedAsAnyDocument) {
  TestService test;
  for (const std::size_t datasets : {0U, 1U, 2U}) {
    const std::string list = test.get("/v1/datasets").body;
    const Json parsed = Json::parse(list);
    EXPECT_EQ(parsed["datasets"].size(), datasets);
    EXPECT_EQ(list, dump(parsed));
    posted_id(test.post("GOOD", {}, kWait));
  }
}

TEST(Api, TheListKnowsItsParametersAlone) {
  TestService test;
  Request request;
  request.path = "/v1/datasets";
  EXPECT_EQ(test.api().handle(request).status, 200);
  request.query = {{"state", "ready"}};
  EXPECT_EQ(test.api().handle(request).status, 200);
  request.query = {{"error", "2"}};
  for (const char* method : {"GET", "HEAD"}) {
    request.method = method;
    const Response refused = test.api().handle(request);
    EXPECT_EQ(refused.status, 400);
    EXPECT_EQ(slug_of(refused), "option-unknown");
    EXPECT_EQ(body_of(refused)["parameter"], "error");
  }
  request.path = "/stac/collections/datasets/items";
  request.query = {{"limit", "5"}, {"q", "alps"}};
  const Response refused = test.api().handle(request);
  EXPECT_EQ(slug_of(refused), "option-unknown");
  EXPECT_EQ(body_of(refused)["accepted"], "limit, after, bbox");
}

TEST(Api, AMissingTileSaysWhichThereAre) {
  TestService test;
  const std::string base = "/v1/datasets/" + posted_id(test.post("GOOD", {}, kWait));
  const Response missing = test.get(base + "/tiles/1/3/0.drc");
  EXPECT_EQ(missing.status, 404);
  EXPECT_EQ(slug_of(missing), "tile-unknown");
  EXPECT_THAT(std::string(body_of(missing)["accepted"]), HasSubstr("levels 0 to 1"));
  EXPECT_THAT(std::string(body_of(missing)["accepted"]), HasSubstr("x 1..1, y 1..1"));
  EXPECT_EQ(test.get(base + "/tiles/25/0/0.drc").status, 404);
  EXPECT_EQ(slug_of(test.get("/v1/datasets/nobody/tiles/0/0/0.drc")), "dataset-unknown");
  EXPECT_EQ(slug_of(test.get(base + "/tiles/0/0/0.png")), "not-found");
}

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
  EXPECT_EQ(slug_of(test.post("GOOD", {{"eror", "1"}})), "option-unknown");
  EXPECT_EQ(body_of(test.post("GOOD", {{"error", "x"}}))["parameter"], "error");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-type", "multipart/form-data"}})), "form-invalid") << "without a boundary";
  EXPECT_EQ(test.post("GOOD", {}, {{"content-type", "multipart/mixed; boundary=x"}}).status, 415);
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-type", "multipart/form-data; boundary=x"}})), "body-incomplete");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-length", "9"}})), "body-incomplete");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"content-length", "-9"}})), "request-invalid");
  EXPECT_EQ(slug_of(test.post("GOOD", {}, {{"prefer", "wait=soon"}})), "option-invalid");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"vertical_datum", "/etc/passwd"}})), "option-forbidden");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"crs", "/etc/passwd"}})), "option-forbidden");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"water_mask", "sea.tif"}})), "option-forbidden");
  EXPECT_EQ(slug_of(test.post("GOOD", {{"crs", "+proj=longlat +nadgrids=/etc/passwd"}})), "option-forbidden");
  EXPECT_EQ(test.leftovers(), 0u);
  EXPECT_TRUE(body_of(test.get("/v1/datasets"))["datasets"].empty());
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
  test.send("DELETE", "/v1/datasets/" + behind);
  test.send("DELETE", "/v1/datasets/" + id);
  std::string last;
  while (auto piece = stream.next_piece()) last = *piece;
  EXPECT_THAT(last, HasSubstr("event: failed"));

  const std::string good = posted_id(test.post("GOOD", {}, kWait));
  Response done = test.get("/v1/datasets/" + good + "/events");
  EXPECT_THAT(done.next_piece().value_or(""), HasSubstr("event: ready"));
  EXPECT_FALSE(done.next_piece());
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
