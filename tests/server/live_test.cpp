// What can be read of a dataset while its build goes on: provisional tiles at the addresses of the final ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "live_fixture.h"
#include "server/jobs/provisional.h"

namespace cordillera::server {
namespace {

using live_fixture::Live;
using testing::HasSubstr;
using testing::Not;

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

TEST_F(Live, OfALazyOneThatIsBuiltInFullStatusAndEventsSaySo) {
  const std::string id = id_of(test_.post("SLOW", {{"build", "lazy"}}));
  EXPECT_TRUE(eventually([&] { return test_.service().hub().now(id).progress.has_value(); }));
  EXPECT_EQ(body_of(test_.get(at(id)))["build"], "full") << "it makes blocks, and shows none";
  EXPECT_THAT(test_.get(at(id, "/events")).next_piece().value_or(""), Not(HasSubstr("\"build\":")));
  const std::string behind = id_of(test_.post("LIVE", {{"build", "lazy"}}, kWait));
  const Json status = body_of(test_.get(at(behind)));
  EXPECT_EQ(status["provisional"], true) << "who posts it waits until it can be read";
  EXPECT_EQ(status["build"], "lazy");
  EXPECT_THAT(test_.get(at(behind, "/events")).next_piece().value_or(""), HasSubstr("\"build\":\"lazy\""));
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

/// Its job waits for its turn, so nothing of it can be read yet.
TEST_F(Live, ALazyOneIsAskedAgainInAMoment) {
  const std::string first = id_of(test_.post("SLOW"));
  EXPECT_TRUE(eventually([&] { return test_.service().hub().now(first).progress.has_value(); }));
  const std::string id = id_of(test_.post("GOOD", {{"build", "lazy"}}));
  const Json soon = body_of(test_.get(at(id, "/manifest.json")));
  EXPECT_EQ(soon["type"], "urn:cordillera:problem:dataset-not-ready");
  EXPECT_EQ(soon["accepted"], "asking again in a moment");
  EXPECT_THAT(body_of(test_.get(at(id, "/versions")))["accepted"], HasSubstr("build=full")) << "a version has all of its blocks";
  EXPECT_EQ(test_.send("DELETE", at(first)).status, 204);
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

}  // namespace
}  // namespace cordillera::server
