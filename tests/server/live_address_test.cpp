// /v1/live?url=…: datasets of what stands at an address, without a POST.
#include "live_address_fixture.h"

namespace cordillera::server {
namespace {

TEST_F(LiveAddress, AnAddressIsADataset) {
  start();
  const std::string cone = query("/dems/cone.asc");
  const std::string led = whole("/v1/live/tileset.json" + cone);
  EXPECT_THAT(led, AllOf(HasSubstr("307"), HasSubstr("Location: /v1/datasets/cone-"), HasSubstr("Cache-Control: no-store")));
  EXPECT_THAT(body("/v1/live/tileset.json" + cone, "-L"), HasSubstr("geometricError"))
      << "whoever follows waits until it is there\n"
      << server_.log();
  const std::string id = id_of(cone);
  EXPECT_THAT(led, HasSubstr("/v1/datasets/" + id + "/tileset.json"));
  EXPECT_THAT(whole("/v1/live" + cone), AllOf(HasSubstr("200 OK"), HasSubstr("Content-Location: /v1/datasets/" + id)));
  for (const char* path : {"tiles/0/1/0.drc", "terrain/0/1/0.terrain", "terrain-rgb/0/0/0.png"}) {
    const std::string tile = body(std::string("/v1/live/") + path + cone);
    EXPECT_FALSE(tile.empty()) << path;
    EXPECT_EQ(tile, body("/v1/datasets/" + id + "/" + path)) << path;
  }
  EXPECT_THAT(body("/v1/live/layer.json" + cone, "-L"), HasSubstr("terrain/{z}/{x}/{y}.terrain"));
  EXPECT_THAT(json("/v1/live/terrain-rgb.json" + cone, "-L")["tiles"][0].dump(),
              HasSubstr(server_.base() + "/v1/datasets/" + id + "/terrain-rgb/"));
  EXPECT_NEAR(top(cone), 2000, 60);
  EXPECT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  EXPECT_THAT(body("/v1/live/events" + cone, "-L"), HasSubstr("event: ready"));
  EXPECT_THAT(body("/v1/live.pmtiles" + cone + "&format=hillshade", "-L --retry 100"), testing::StartsWith("PMTiles"));
  EXPECT_EQ(body("/v1/live/mesh.stl" + cone + "&level=0", "-L"), body("/v1/datasets/" + id + "/mesh.stl?level=0"));
  EXPECT_THAT(status(id)["source"].dump(), HasSubstr("/dems/cone.asc"));
  EXPECT_EQ(asked("/dems/cone.asc"), 1) << "it was fetched once for all of these";
  EXPECT_NE(id_of(query("/dems/cone.asc", "&title=Other")), id) << "other options, another dataset";
  EXPECT_EQ(slug("/v1/live/tiles/3/7/7.drc" + cone), "tile-unknown");
  EXPECT_THAT(body("/metrics"), HasSubstr("cordillera_http_requests_total{route=\"live\""));
}

TEST_F(LiveAddress, AWaitInVainEndsWithTheStatus) {
  host_.hangs("/dems/slow.asc");
  start();
  const std::string slow = query("/dems/slow.asc");
  for (const std::string wait : {"0", "1"})
    EXPECT_THAT(whole("/v1/live" + slow, "-H 'Prefer: wait=" + wait + "'"),
                AllOf(HasSubstr("202 Accepted"), HasSubstr("\"state\"")));
  EXPECT_EQ(slug("/v1/live/tiles/0/1/0.drc" + slow, "-H 'Prefer: wait=0'"), "tile-not-ready");
}

TEST_F(LiveAddress, OnlyWhatTheOperatorAllowsIsFetched) {
  start();
  EXPECT_EQ(slug("/v1/live"), "option-invalid");
  EXPECT_EQ(slug("/v1/live/tileset.json"), "option-invalid");
  for (const char* target : {"/private/cone.asc", "/dems/../private/cone.asc", "/dems/%2e%2e/x.asc"})
    EXPECT_EQ(slug("/v1/live" + query(target)), "option-forbidden") << target;
  EXPECT_EQ(json("/v1/live?url=file:///etc/passwd")["parameter"], "url");
  EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc", "&eror=3")), "option-unknown");
  for (const char* other : {"&build=full", "&updates=1", "&dry_run=1", "&source=http://127.0.0.1/"})
    EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc", other)), "option-unknown") << other;
  EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc", "&crs=/etc/passwd")), "option-repeated");
  EXPECT_EQ(slug("/v1/live/sources" + query("/dems/cone.asc")), "not-found");
  EXPECT_EQ(slug("/v1/live" + query("/dems/cone.asc"), "-H 'Origin: https://elsewhere.example'"), "origin-forbidden");
  EXPECT_EQ(json("/v1/datasets")["datasets"].size(), 0u);
  EXPECT_TRUE(host_.asked().empty());
  server_.end(SIGTERM);
  server_.start(folder_.path());
  const Json none = json("/v1/live" + query("/dems/cone.asc"));
  EXPECT_THAT(none.dump(), AllOf(HasSubstr("option-forbidden"), HasSubstr("--source-allow")));
}

TEST_F(LiveAddress, NobodySeesWhatMayBeASignature) {
  start();
  const std::string sought = query("/dems/signed.asc?sig=secret");
  const std::string id = id_of(sought);
  EXPECT_EQ(asked("/dems/signed.asc?sig=secret"), 1);
  std::string all = whole("/v1/live" + sought) + whole("/v1/live/tileset.json" + sought) +
                    whole("/v1/live/tileset.json" + sought, "-L") + whole("/v1/live/manifest.json" + sought, "-L");
  all += whole("/v1/datasets") + whole("/v1/datasets/" + id) + whole("/v1/datasets/" + id + "/sources") +
         whole("/stac/collections/datasets/items") + whole("/metrics");
  all += whole("/v1/live" + query("/dems/none.asc?sig=secret"), "-H 'Prefer: wait=500'") +
         whole("/v1/live" + query("/private/none.asc?sig=secret"));
  EXPECT_THAT(all, Not(HasSubstr("secret")));
  EXPECT_THAT(all, HasSubstr("/dems/signed.asc"));
  EXPECT_THAT(server_.log(), Not(HasSubstr("secret")));
  EXPECT_THAT(file_text(folder_.path() / "data" / "audit.jsonl"), AllOf(HasSubstr(id), Not(HasSubstr("secret"))));
}

TEST_F(LiveAddress, WhatChangesIsBuiltAnewAndWhatIsGoneGoes) {
  start({"--live-fresh", "0"});
  const std::string cone = query("/dems/cone.asc");
  const std::string id = id_of(cone);
  EXPECT_NEAR(top(cone), 2000, 60);
  ASSERT_TRUE(eventually([&] {
    return body("/metrics").find("cordillera_live_asked_total{outcome=\"same\"}") != std::string::npos;
  })) << server_.log();
  // It may have been asked while provisional tiles were there and the build went on.
  EXPECT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  const std::string told = server_.log(), fetch = "its raster is fetched";
  EXPECT_EQ(told.find(fetch), told.rfind(fetch)) << "it was asked, and is the same\n" << told;
  host_.has_tagged("/dems/cone.asc", cone_of(3000), "\"two\"");
  ASSERT_TRUE(eventually([&] { return std::abs(top(cone) - 3000) < 60; })) << server_.log();
  EXPECT_EQ(id_of(cone), id) << "its address stays";
  host_.has_no_more("/dems/cone.asc");
  ASSERT_TRUE(eventually([&] { return slug("/v1/live/tiles/0/1/0.drc" + cone) == "dataset-failed"; })) << server_.log();
  EXPECT_THAT(body("/v1/live" + cone, "-H 'Prefer: wait=500'"), HasSubstr("source-unreachable"));
  host_.has_tagged("/dems/cone.asc", cone_of(4000), "\"three\"");
  EXPECT_TRUE(eventually([&] { return std::abs(top(cone) - 4000) < 60; })) << "asked for again it is tried again\n"
                                                                           << server_.log();
}

TEST_F(LiveAddress, WhatCannotBeBuiltTakesNothingAway) {
  start({"--live-fresh", "0"});
  const std::string cone = query("/dems/cone.asc"), id = id_of(cone);
  ASSERT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  host_.has_tagged("/dems/cone.asc", "<html>closed for today</html>", "\"page\"");
  ASSERT_TRUE(eventually([&] { return top(cone) > 0 && server_.log().find("what was built stays") != std::string::npos; }))
      << server_.log();
  EXPECT_EQ(status(id)["state"], "ready");
  EXPECT_NEAR(top(cone), 2000, 60);
  host_.has_tagged("/dems/cone.asc", cone_of(3000), "\"two\"");
  EXPECT_TRUE(eventually([&] { return std::abs(top(cone) - 3000) < 60; })) << server_.log();
}

TEST_F(LiveAddress, ACopyThatIsSlowKeepsNoOtherBuildWaiting) {
  host_.hangs("/dems/slow.asc");
  start({"--jobs", "1"});
  const std::string options = "crs=EPSG:4326&vertical_datum=ellipsoid&error=20";
  const auto post = [&](const std::string& query, const std::string& more = "-X POST") {
    return json("/v1/datasets?" + options + query, more).value("id", "");
  };
  const std::string slow = post("&build=full&source=" + host_.address() + "/dems/slow.asc");
  ASSERT_TRUE(eventually([&] { return asked("/dems/slow.asc") > 0; })) << server_.log();
  std::ofstream(folder_.path() / "cone.asc") << cone_of(1500);
  const std::string quick = post("&name=cone.asc", "--data-binary @" + (folder_.path() / "cone.asc").string());
  EXPECT_TRUE(eventually([&] { return status(quick)["state"] == "ready"; })) << server_.log();
  EXPECT_THAT(server_.log(), Not(HasSubstr("dataset " + slow + ": failed"))) << "that would have ended its wait";
  EXPECT_EQ(shell("curl -q -s -m 500 -o /dev/null -w '%{http_code}' -X DELETE " + server_.base() + "/v1/datasets/" + slow).output,
            "204");
}

TEST_F(LiveAddress, AKilledServiceFindsItAgain) {
  start();
  const std::string cone = query("/dems/cone.asc");
  const std::string id = id_of(cone), tile = body("/v1/live/tiles/0/1/0.drc" + cone);
  server_.end(SIGKILL);
  start();
  EXPECT_EQ(id_of(cone), id);
  EXPECT_EQ(body("/v1/live/tiles/0/1/0.drc" + cone), tile);
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched")));
  server_.end(SIGTERM);
  ASSERT_EQ(shell(kProgram + " vacuum " + (folder_.path() / "data").string()).code, 0);
  start();
  EXPECT_EQ(body("/v1/live/tiles/0/1/0.drc" + cone), tile);
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched"))) << "the note of what was fetched is still there";
}

TEST_F(LiveAddress, WithTokensOnlyWhoMayPostHasThemFetched) {
  const std::string tokens = (folder_.path() / "tokens").string();
  const auto token = [&](const char* name, const char* role) {
    std::string said =
        shell(kProgram + " token new --name " + name + " --role " + role + " --file " + tokens + " 2>/dev/null").output;
    const auto at = said.find("token: ") + 7;
    return "-H 'Authorization: Bearer " + said.substr(at, said.find('\n', at) - at) + "'";
  };
  const std::string writer = token("writer", "write"), reader = token("reader", "read");
  start({"--tokens", tokens});
  const std::string open = query("/dems/cone.asc"), hidden = query("/dems/cone.asc", "&private=1");
  EXPECT_EQ(slug("/v1/live" + open), "token-missing");
  EXPECT_EQ(slug("/v1/live" + open, reader), "role-too-low");
  EXPECT_THAT(body("/v1/live" + query("/private/x.asc")), Not(HasSubstr(host_.address() + "/dems/")))
      << "what is allowed is not everybody's to know";
  const std::string id = id_of(open, writer);
  EXPECT_THAT(whole("/v1/live/tiles/0/1/0.drc" + open), HasSubstr("200 OK")) << "what is there may be read";
  const std::string secret = id_of(hidden, writer);
  EXPECT_NE(secret, id);
  EXPECT_EQ(slug("/v1/live/tiles/0/1/0.drc" + hidden), "token-missing");
  EXPECT_THAT(whole("/v1/live/tiles/0/1/0.drc" + hidden, reader), AllOf(HasSubstr("200 OK"), Not(HasSubstr("public"))));
  server_.end(SIGTERM);
  start({"--tokens", tokens, "--live-open", "1"});
  EXPECT_THAT(whole("/v1/live/tiles/0/1/0.drc" + query("/dems/cone.asc", "&title=New")), HasSubstr("200 OK"));
  EXPECT_EQ(slug("/v1/live/tiles/0/1/0.drc" + hidden), "token-missing");
  curl("-X PATCH " + writer + " '" + server_.base() + "/v1/datasets/" + id + "?private=1'");
  for (const char* path : {"/v1/live", "/v1/live/tileset.json", "/v1/live/events", "/v1/live/tiles/0/1/0.drc"})
    EXPECT_EQ(slug(path + open), "token-missing") << path << " of a dataset that has become private";
  EXPECT_EQ(slug("/v1/live" + open, reader), "") << "who may read it has it";
}

}  // namespace
}  // namespace cordillera::server
