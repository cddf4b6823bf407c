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

/// The manifest of provisional tiles has it, too.
TEST(Api, ADatasetIsCalledByItsNameWhereItHasNoTitle) {
  TestService test;
  const Response posted = test.post("SLOW", {{"name", "Alps.tif"}});
  EXPECT_EQ(body_of(posted)["title"], "Alps.tif");
  EXPECT_EQ(body_of(test.get("/v1/datasets/" + posted_id(posted)))["title"], "Alps.tif");
  EXPECT_EQ(body_of(test.get("/v1/datasets"))["datasets"][0]["title"], "Alps.tif");
  EXPECT_EQ(body_of(test.post("SLOW", {{"name", "b.tif"}, {"title", "Hills"}}))["title"], "Hills");
}

/// Proxies give up after a minute.
TEST(Api, WhatIsMadeOfAllOfADatasetIsWaitedForAsLongAsItsClientSays) {
  Limits limits;
  const auto seconds = [&](const std::string& method, const std::string& prefer) {
    Request request;
    request.method = method;
    if (!prefer.empty()) request.headers["prefer"] = prefer;
    return may_wait_for_whole(limits, request).longest.count();
  };
  limits.wait_seconds = 600;
  EXPECT_EQ(seconds("GET", ""), 25);
  EXPECT_EQ(seconds("GET", "wait=300"), 300);
  EXPECT_EQ(seconds("GET", "wait=0"), 0);
  EXPECT_EQ(seconds("HEAD", ""), 0);
  EXPECT_EQ(seconds("HEAD", "wait=300"), 0);
  limits.wait_seconds = 5;
  EXPECT_EQ(seconds("GET", ""), 5);
  EXPECT_EQ(seconds("GET", "wait=300"), 5);
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

/// Clients add words of their own to the addresses of tiles: what is nearly one of ours is told, and no more than that.
TEST(Api, AMisspeltWordOfATileIsToldItsNeighbour) {
  TestService test;
  const std::string tile = "/v1/datasets/" + posted_id(test.post("GOOD", {}, kWait)) + "/tiles/W/1/1/1.glb";
  for (const auto& [word, told] :
       {std::pair{"normal", "did you mean normals?"}, {"normals", ""}, {"v", ""}, {"extensions", ""}}) {
    Request request;
    request.method = "GET";
    request.path = tile;
    request.query.emplace_back(word, "vertex");
    const Response answer = TestService::settled(test.api().handle(request));
    EXPECT_EQ(answer.status, 200) << word;
    EXPECT_EQ(answer.header("Cordillera-Hint"), told) << word;
  }
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
  request.query = {{"limit", "5"}, {"bbox", "0,0,1,1"}};
  const Json self = body_of(test.api().handle(request))["links"][0];
  EXPECT_EQ(self["rel"], "self");
  EXPECT_TRUE(std::string(self["href"]).ends_with("/items?limit=5&bbox=0,0,1,1")) << self;
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
  EXPECT_THAT(body_of(test.get("/openapi"))["accepted"], HasSubstr("/api,")) << "it is searched for by that name";
}

}  // namespace
}  // namespace cordillera::server
