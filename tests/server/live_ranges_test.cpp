// Rasters at an address of which only what is looked at is fetched.
#include "live_address_fixture.h"

namespace cordillera::server {
namespace {

TEST_F(ByRanges, OfALargeCogOnlyWhatIsLookedAtComes) {
  start();
  const std::string one = tile_at(11.5, 46.6), other = tile_at(11, 46.2);
  const std::string id = id_of(sought());
  EXPECT_LT(host_.sent(), hills_.size() / 3) << "provisional tiles are made of its overviews";
  const std::string made = final_tile(id, one);
  EXPECT_FALSE(made.empty());
  EXPECT_LT(host_.sent(), hills_.size() * 2 / 3) << server_.log();
  EXPECT_EQ(status(id)["build"], "lazy");
  const std::string copy = posted();
  EXPECT_EQ(final_tile(copy, one), made) << "the bytes of a raster that was posted";
  const std::string backup = (folder_.path() / "backup").string(), data = (folder_.path() / "data").string();
  ASSERT_EQ(shell(kProgram + " backup " + data + " -o " + backup).code, 0);
  server_.end(SIGKILL);
  start();
  const auto before = host_.sent();
  EXPECT_EQ(final_tile(id, one), made);
  EXPECT_EQ(host_.sent(), before);
  EXPECT_EQ(final_tile(id, other), final_tile(copy, other)) << "it goes on where it was";
  EXPECT_LT(host_.sent(), hills_.size());
  EXPECT_THAT(server_.log(), Not(HasSubstr("is fetched")));
  server_.end(SIGTERM);
  fs::remove_all(data);
  ASSERT_EQ(shell(kProgram + " restore " + backup + " --data " + data).code, 0);
  start();
  EXPECT_EQ(status(id)["asleep"], true) << "a backup has no raster that is there in parts";
  EXPECT_EQ(final_tile(id, one), made) << server_.log();
  EXPECT_TRUE(fs::exists(folder_of(id)));
  shell("curl -q -s -X DELETE '" + server_.base() + "/v1/datasets/" + id + "'");
  EXPECT_FALSE(fs::exists(folder_of(id)));
}

TEST_F(ByRanges, TheFirstRequestForATileGetsAProvisionalOneAsSoonAsItIsThere) {
  start();
  const std::string id = id_of(sought());
  Json blocks;
  ASSERT_TRUE(eventually([&] { return (blocks = json("/v1/datasets/" + id + "/manifest.json")["done_blocks"]).is_object(); }));
  const std::string coarse = tile_at(11.5, 46.6, blocks["level"]), fine = tile_at(11.5, 46.6),
                    is = "Cordillera-Provisional: true";
  EXPECT_THAT(whole("/v1/live" + coarse + sought() + "&title=one"), AllOf(HasSubstr("200 OK"), HasSubstr(is)));
  EXPECT_THAT(whole("/v1/live" + fine + sought() + "&title=two"), AllOf(HasSubstr("200 OK"), Not(HasSubstr(is))))
      << "nothing stands in its place";
  EXPECT_THAT(whole("/v1/live" + coarse + sought() + "&title=three", "-H 'Prefer: wait=500'"),
              AllOf(HasSubstr("200 OK"), Not(HasSubstr(is))));
}

TEST_F(ByRanges, AnAddressIsPostedToo) {
  start();
  const auto post = [&](const std::string& options) {
    return curl("-H 'Prefer: wait=500' -H 'Idempotency-Key: hills' -d source=" + host_.address() + kCog +
                " -d crs=EPSG:4326 -d vertical_datum=ellipsoid -d error=20 -d max_level=12 " + options + " '" + server_.base() +
                "/v1/datasets'");
  };
  Json posted = post("");
  const std::string id = posted.value("id", "");
  EXPECT_EQ(posted["build"], "lazy") << posted;
  EXPECT_LT(host_.sent(), hills_.size()) << "all provisional tiles are there";
  EXPECT_THAT(body("/v1/datasets/" + id + "/tileset.json"), HasSubstr("geometricError"));
  EXPECT_THAT(status(id)["source"].dump(), HasSubstr(kCog));
  EXPECT_EQ(post("").value("id", ""), id) << "the same request, another answer to it";
  EXPECT_EQ(post("-d build=lazy").value("id", ""), id) << "what is meant without a word";
  EXPECT_THAT(post("-d updates=1").dump(), HasSubstr("idempotency-key-reused")) << "copied and kept, it would be another dataset";
  EXPECT_THAT(post("-d build=lazy -d dry_run=1").dump(), HasSubstr("options-conflict"));
  const auto of_json = [&](const std::string& more) {
    return curl("-H 'Prefer: wait=500' -H 'Content-Type: application/json' -d '{\"source\": \"" + host_.address() + kCog +
                R"(", "crs": "EPSG:4326", "vertical_datum": "ellipsoid")" + more + "}' '" + server_.base() + "/v1/datasets'");
  };
  auto before = host_.sent();
  Json alone = of_json("");
  EXPECT_EQ(alone["build"], "lazy") << alone;
  EXPECT_EQ(alone["provisional"], true) << alone;
  EXPECT_LT(host_.sent() - before, hills_.size());
  before = host_.sent();
  Json copied = of_json(R"(, "build": "full", "error": 50, "max_level": 10)");
  EXPECT_EQ(copied["state"], "ready") << copied;
  EXPECT_GE(host_.sent() - before, hills_.size());
  EXPECT_EQ(json("/v1/datasets/" + copied.value("id", "") + "/sources")["sources"].size(), 1u) << "it is kept";
}

TEST_F(ByRanges, ARasterThatChangesMeanwhileIsReadAnew) {
  start();
  const std::string id = id_of(sought());
  host_.has_parts(kCog, cog_of(3000), "\"two\"");
  final_tile(id, tile_at(11.5, 46.6));
  const std::string place = "/elevation?points=11.5,46.6";
  ASSERT_TRUE(eventually([&] {
    Json answer = json("/v1/datasets/" + id + place);
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number() &&
           answer["points"][0]["ellipsoidal_height"].get<double>() > 2500;
  })) << server_.log();
  EXPECT_THAT(server_.log(), HasSubstr("has another raster than it had"));
}

/// Such as one that is being written.
TEST_F(ByRanges, ARasterThatIsDamagedForAMomentTakesNothingAway) {
  start({"--live-fresh", "0"});
  const std::string id = id_of(query(kCog, "&max_level=9")), place = "/elevation?points=11.5,46.6";
  const auto height = [&] {
    Json answer = json("/v1/datasets/" + id + place);
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number()
               ? answer["points"][0]["ellipsoidal_height"].get<double>()
               : 0;
  };
  ASSERT_TRUE(eventually([&] { return status(id)["state"] == "ready"; })) << server_.log();
  EXPECT_NEAR(height(), 1000, 300);
  host_.has_parts(kCog, hills_.substr(0, hills_.size() / 2), "\"half\"");
  ASSERT_TRUE(eventually([&] { return height() > 0 && server_.log().find("what was built stays") != std::string::npos; }))
      << server_.log();
  EXPECT_EQ(status(id)["state"], "ready");
  EXPECT_NEAR(height(), 1000, 300);
  EXPECT_FALSE(fs::exists(folder_of(id) / "next-hills.tif")) << "what came of it goes";
  host_.has_parts(kCog, cog_of(3000), "\"two\"");
  EXPECT_TRUE(eventually([&] { return height() > 2500; })) << server_.log();
}

TEST_F(ByRanges, ASlowSourceKeepsNoOtherBuildWaiting) {
  host_.has_parts(kCog, hills_, "\"one\"", RasterHost::Parts::held);
  host_.hold_back();
  server_.start(folder_.path(), {"--source-allow", host_.address() + "/dems/", "--max-wait", "1", "--jobs", "1"});
  const auto post = [&](const std::string& raster) {
    return curl(raster + " '" + server_.base() +
                "/v1/datasets?name=hills.tif&crs=EPSG:4326&vertical_datum=ellipsoid&error=20&max_level=11'")
        .value("id", "");
  };
  const std::string slow = post("-d source=" + host_.address() + kCog + " -d build=lazy");
  ASSERT_TRUE(eventually([&] { return host_.asked().size() > 1; })) << "its job waits for more than its beginning";
  const std::string other = post("--data-binary @" + raster_);
  // As long as a job may wait for its source while others wait.
  EXPECT_EQ(slug("/v1/datasets/" + slow + tile_at(11.5, 46.6), "-H 'Prefer: wait'"), "tile-not-ready");
  host_.let_go();
  ASSERT_TRUE(eventually([&] { return status(other)["state"] == "ready"; })) << server_.log();
  EXPECT_THAT(server_.log(), HasSubstr("dataset " + slow + ": its source is slow"));
  host_.has_parts(kCog, hills_, "\"one\"");
  const std::string tile = tile_at(11.5, 46.6), made = body("/v1/datasets/" + other + tile);
  EXPECT_TRUE(eventually([&] { return final_tile(slow, tile) == made; })) << "it goes on where it was: " << server_.log();
}

TEST_F(ByRanges, WhoSendsPartsAtFirstAloneIsCopied) {
  host_.has_parts(kCog, hills_, "\"one\"", RasterHost::Parts::not_after_the_first);
  start();
  EXPECT_FALSE(final_tile(id_of(sought()), tile_at(11.5, 46.6)).empty()) << server_.log();
  EXPECT_GE(host_.sent(), hills_.size());
}

}  // namespace
}  // namespace cordillera::server
