// Which addresses a command line of fetch means.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace cordillera::server
