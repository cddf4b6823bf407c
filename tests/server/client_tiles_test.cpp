// Which addresses a command line of fetch means.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/cli/commands.h"
#include "server/client/events.h"
#include "server/client/tiles.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

TEST(ClientTiles, OfABoxAndLevels) {
  const auto addresses = [](std::vector<double> bounds, const client::TileWords& words) {
    const auto found = client::addresses_of({{"bounds", bounds}, {"min_level", 0u}, {"max_level", 3u}}, words);
    return found ? *found : std::vector<std::string>{found.problem().line()};
  };
  using testing::ElementsAre;
  EXPECT_THAT(addresses({0, 0, 45, 45}, {"", "0-1", "drc"}), ElementsAre("tiles/0/1/0.drc", "tiles/1/2/1.drc"));
  EXPECT_THAT(addresses({0, 0, 45, 45}, {"", "2", "terrain"}), ElementsAre("terrain/2/4/2.terrain"))
      << "an edge of the data on an edge of tiles";
  EXPECT_THAT(addresses({0, 0, 45, 45}, {"30,30,60,60", "3", "glb"}), ElementsAre("tiles/3/9/5.glb"));
  // Across the antimeridian, and asked for from its other side.
  EXPECT_THAT(addresses({170, 0, -170, 10}, {"", "2", "drc"}), ElementsAre("tiles/2/0/2.drc", "tiles/2/7/2.drc"));
  EXPECT_THAT(addresses({170, 0, -170, 10}, {"-175,1,-172,2", "2", "drc"}), ElementsAre("tiles/2/0/2.drc"));
  EXPECT_THAT(addresses({-20, 0, -10, 10}, {"170,0,-15,10", "1", "drc"}), ElementsAre("tiles/1/1/1.drc"));
  for (const client::TileWords& wrong : {client::TileWords{"", "4", "drc"},
                                         {"", "2-1", "drc"},
                                         {"", "x", "drc"},
                                         {"", "1", "png"},
                                         {"50,50,60,60", "", "drc"},
                                         {"1,2,3", "", "drc"}})
    EXPECT_THAT(addresses({0, 0, 45, 45}, wrong), ElementsAre(HasSubstr("accepted: "))) << wrong.bbox << wrong.level;
  for (const char* bad : {"..", "a/../b.c", "/etc/passwd.x", "a//b.c", ".x", "tiles", "a.b?c", ""})
    EXPECT_FALSE(client::address_named(bad)) << bad;
  EXPECT_EQ(*client::address_named("10/1/2.terrain"), "terrain/10/1/2.terrain");
  EXPECT_EQ(*client::address_named("layer.json"), "layer.json");
}

/// A manifest is what a service says, and that may be anything.
TEST(ClientTiles, OfAManifestThatIsNoneAreAProblem) {
  const auto type = [](const Json& least, const Json& finest, const char* format, bool middle) {
    const Json manifest = {{"bounds", {-180, -90, 180, 90, -400, 8848}}, {"min_level", least}, {"max_level", finest}};
    const auto found =
        middle ? client::addresses_from_the_middle(manifest, format) : client::addresses_of(manifest, {"", "", format});
    return found ? "" : found.problem().type;
  };
  for (const bool middle : {false, true}) {
    EXPECT_EQ(type("a", 3u, "drc", middle), "answer-unknown");
    EXPECT_EQ(type(-1, 3u, "drc", middle), "answer-unknown");
    EXPECT_EQ(type(63u, 4000000000u, "drc", middle), "answer-unknown");
    EXPECT_EQ(type(0u, std::uint64_t{1} << 40, "drc", middle), "answer-unknown");
    EXPECT_EQ(type(5u, 3u, "drc", middle), "answer-unknown");
    EXPECT_EQ(type(0u, 3u, "drc", middle), "");
  }
}

TEST(ClientTiles, OfABoxThatIsNoneAreAProblem) {
  for (const double east : {1e308, -1e308, 1e9}) {
    const auto found = client::addresses_of({{"bounds", {5.0, 5.0, east, 6.0}}, {"min_level", 0u}, {"max_level", 3u}}, {});
    ASSERT_FALSE(found) << east;
    EXPECT_EQ(found.problem().type, "answer-unknown") << east;
  }
}

TEST(ClientTiles, OfALayerThatIsNoneAreAProblem) {
  constexpr std::int64_t kFar = 9'000'000'000'000'000'000;
  const auto type = [](const Json& range, const std::string& bbox) {
    const Json layer = {{"available", {Json::array({range})}}};
    const auto found = client::addresses_of_layer({{"bounds", {-180, -90, 180, 90}}, {"min_level", 0u}, {"max_level", 0u}}, layer,
                                                  {bbox, "", "terrain"});
    return found ? "" : found.problem().type;
  };
  for (const char* bbox : {"", "1,1,2,2"}) {
    EXPECT_EQ(type({{"startX", 0}, {"startY", 1}, {"endX", kFar}, {"endY", 0}}, bbox), "answer-unknown");
    EXPECT_EQ(type({{"startX", -5}, {"startY", -kFar}, {"endX", 1}, {"endY", 0}}, bbox), "answer-unknown");
    EXPECT_EQ(type({{"startX", 0}, {"startY", 0}, {"endX", 0}, {"endY", kFar}}, bbox), "answer-unknown");
    EXPECT_EQ(type({{"startX", 0}, {"startY", 0}, {"endX", 1}, {"endY", 0}}, bbox), "");
  }
}

TEST(ClientTiles, OfALayerHaveTheirSiblings) {
  const Json root = {{"startX", 0}, {"startY", 0}, {"endX", 1}, {"endY", 0}};
  const Json first = {{"startX", 2}, {"startY", 0}, {"endX", 3}, {"endY", 1}},
             second = {{"startX", 4}, {"startY", 2}, {"endX", 7}, {"endY", 3}};
  const Json layer = {{"available", {Json::array({root}), Json::array({first}), Json::array({second})}}};
  const auto addresses = [&](const client::TileWords& words) {
    const auto found =
        client::addresses_of_layer({{"bounds", {0, 0, 80, 45}}, {"min_level", 2u}, {"max_level", 2u}}, layer, words);
    return found ? *found : std::vector<std::string>{found.problem().line()};
  };
  using testing::ElementsAre;
  EXPECT_EQ(addresses({"", "", "terrain"}).size(), 2 + 4 + 8);
  EXPECT_THAT(addresses({"", "0", "terrain"}), ElementsAre("terrain/0/0/0.terrain", "terrain/0/1/0.terrain"));
  EXPECT_THAT(addresses({"1,1,2,2", "2", "terrain"}),
              ElementsAre("terrain/2/4/2.terrain", "terrain/2/4/3.terrain", "terrain/2/5/2.terrain", "terrain/2/5/3.terrain"));
  EXPECT_THAT(addresses({"100,1,110,2", "", "terrain"}), ElementsAre(HasSubstr("the dataset is elsewhere")));
  EXPECT_THAT(addresses({"", "3", "terrain"}), ElementsAre(HasSubstr("a level from 0 to 2")));
}

/// What a service says may be anybody's text, and a terminal obeys some of it.
TEST(ClientWords, HaveNothingThatATerminalObeys) {
  const std::string bad =
      "D\x1b]0;PWNED\a\x1b[2J\nfake \xc2\x9b"
      "31m";
  const proto::Problem problem =
      client::problem_in({{"type", "urn:cordillera:problem:x\x1b[31m"}, {"detail", bad}, {"accepted", bad}, {"parameter", bad}});
  for (const std::string& text : {problem.type, problem.detail, problem.accepted, problem.parameter,
                                  client::how_it_stands({{"id", bad}, {"state", "ready"}}), client::how_it_stands({{"id", 1}})})
    EXPECT_TRUE(text.find_first_of("\x1b\a\n") == text.npos && text.find("\xc2\x9b") == text.npos) << text;
  proto::Manifest manifest;
  manifest.mutable_source()->set_file(bad);
  manifest.mutable_source()->set_crs(bad);
  manifest.mutable_source()->set_nodata(bad);
  manifest.set_device(bad);
  manifest.add_notes(bad);
  const std::string table = manifest_table(manifest);
  EXPECT_EQ(table.find_first_of("\x1b\a"), table.npos) << table;
  EXPECT_EQ(table.find("\nfake"), table.npos) << table;
}

}  // namespace
}  // namespace cordillera::server
