// Which zooms and places picture formats have, what their TileJSON says, and how a slope is lit.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/pipeline/raster_tiles.h"
#include "tests/pipeline/terrain_made.h"

namespace cordillera::pipeline::faces {
namespace {

using namespace pipeline::testing;

TEST(TerrainRgb, DataAboutTheEquatorHasZoomZero) {
  const Made made({{{7, 126, 62}, {7, 127, 65}}}, hills());
  const Json json = tilejson_of(made.terrain(), "terrain-rgb.json");
  EXPECT_EQ(json["minzoom"], 0) << "there is no level that would be coarse enough, and level 0 is fine enough";
  EXPECT_TRUE(fetch(made.terrain(), "terrain-rgb/0/0/0.png"));
}

TEST(TerrainRgb, CoarseZoomsThatWerePublishedWithoutLevelsDoNotExist) {
  const Made made({{{7, 126, 80}, {7, 127, 81}}}, hills(), 5);
  const Json json = tilejson_of(made.terrain(), "terrain-rgb.json");
  EXPECT_EQ(json["minzoom"], 5) << "at 23 degrees its pixel is larger than a cell of level 5, and smaller than one of level 4";
  EXPECT_EQ(json["zooms"][0]["levels"][0], 5);
  const Place below = tile_at(4, -1, 24);
  EXPECT_FALSE(fetch(made.terrain(), tile_path("terrain-rgb", 4, below.x, below.y, ".png")));
}

TEST(TerrainRgb, BeyondTheEndsOfMercatorThereIsNothing) {
  const Made straddling({{{7, 130, 123}, {7, 130, 126}}}, hills());  // latitudes 83.0 to 88.6
  const Json json = tilejson_of(straddling.terrain(), "terrain-rgb.json");
  EXPECT_NEAR(json["bounds"][3], 85.051129, 1e-6);
  EXPECT_NEAR(Json::parse(*fetch(straddling.terrain(), "web-mercator/layer.json"))["bounds"][3], 85.051129, 1e-6);
  const Place top = tile_at(json["maxzoom"], 3.5, 85.04);
  EXPECT_EQ(top.y, 0);
  EXPECT_TRUE(fetch(straddling.terrain(), tile_path("terrain-rgb", top.z, top.x, 0, ".png")));
  const Made polar({{{7, 130, 126}, {7, 130, 126}}}, hills());  // 87.2 to 88.6
  EXPECT_FALSE(fetch(polar.terrain(), tile_path("terrain-rgb", top.z, top.x, 0, ".png")));
  EXPECT_FALSE(fetch(polar.terrain(), "terrain-rgb/0/0/0.png"));
  std::size_t paths = 0;
  face_named("hillshade")->each_path(polar.terrain(), [&](const std::string& path) { paths += path.ends_with(".png") ? 1 : 0; });
  EXPECT_EQ(paths, 0u);
  const auto refused = find("hillshade.json")->resource->make(polar.terrain(), {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "tile-unknown");
}

TEST(TerrainRgb, TheTileJsonSaysWhatTheTilesAre) {
  const Made made({{{7, 126, 80}, {7, 131, 85}}}, hills());
  for (const std::string face : {"terrain-rgb", "terrarium", "hillshade"}) {
    const Json json = tilejson_of(made.terrain(), face + ".json");
    EXPECT_EQ(json["tilejson"], "3.0.0");
    EXPECT_EQ(json["tiles"], Json::array({face + "/{z}/{x}/{y}.png"})) << "relative to the document";
    EXPECT_TRUE(json["vector_layers"].is_array());
    EXPECT_EQ(json["scheme"], "xyz");
    EXPECT_EQ(json["tileSize"], 256);
    EXPECT_EQ(json["attribution"], "Nobody &lt;nobody@example.org&gt;") << "clients put it into pages";
    const auto bounds = json["bounds"].get<std::array<double, 4>>();
    const auto center = json["center"].get<std::array<double, 3>>();
    EXPECT_NEAR(bounds[0], -180 + 126 * 1.40625, 1e-5);
    EXPECT_NEAR(bounds[3], -90 + 86 * 1.40625, 1e-3) << "chords along a parallel bulge poleward";
    EXPECT_TRUE(center[0] > bounds[0] && center[0] < bounds[2] && center[1] > bounds[1] && center[1] < bounds[3]);
    EXPECT_TRUE(center[2] >= json["minzoom"] && center[2] <= json["maxzoom"]);
    EXPECT_EQ(json["zooms"].size(), json["maxzoom"].get<std::size_t>() - json["minzoom"].get<std::size_t>() + 1);
    if (face == "hillshade") continue;
    EXPECT_EQ(json["encoding"], face == "terrarium" ? "terrarium" : "mapbox");
    EXPECT_EQ(json["vertical_datum"], "EGM96");
  }
}

/// Grey of a plane that rises by so much a metre, under light from the north-west at 45 degrees.
double grey(double east, double north) {
  const double half = std::sqrt(0.5);
  return 255 * std::max(0.0, (half + half * half * east - half * half * north) / std::sqrt(1 + east * east + north * north));
}

TEST(Hillshade, AFlatPlainIsOneGreyAndASlopeIsLitByItsGroundSize) {
  const double cell_deg = kPictureLattice.cell_deg();
  const auto plane = [&](double east, double north, std::int32_t y) {
    const double lat = (-90 + (y + 0.5) * 180 / 128) * std::numbers::pi / 180, metre_deg = 111320;  // within a percent anywhere
    return Made({{{7, 126, y}, {7, 127, y}}}, [=](std::int64_t i, std::int64_t j) -> std::optional<double> {
      const double x = (static_cast<double>(i) * cell_deg - 180) * metre_deg * std::cos(lat);
      const double up = static_cast<double>(j - 256 * y) * cell_deg * metre_deg;
      return 3000 + east * x + north * up;
    });
  };
  struct Case {
    double east, north;
    std::int32_t y;
  };
  // At 23 and at 66 degrees of latitude, where a pixel has 0.92 and 0.41 of its size at the equator.
  for (const Case& c : {Case{0, 0, 80}, Case{0, -0.02, 80}, Case{0.02, 0.01, 110}}) {
    const Made made = plane(c.east, c.north, c.y);
    const int zoom = tilejson_of(made.terrain(), "hillshade.json")["maxzoom"];
    const Place at = tile_at(zoom, -1.5, -90 + (c.y + 0.5) * 180 / 128);
    const Picture picture = read_png(*fetch(made.terrain(), tile_path("hillshade", zoom, at.x, at.y, ".png")), PNG_FORMAT_GA);
    ASSERT_EQ(picture.side, 256u);
    std::size_t seen = 0, close = 0;
    for (std::size_t k = 0; k < 65536; ++k) {
      if (picture.bytes[2 * k + 1] == 0) continue;
      ++seen;
      close += std::abs(picture.bytes[2 * k] - grey(c.east, c.north)) < 0.75 ? 1 : 0;
    }
    EXPECT_GT(seen, 3000u);
    EXPECT_GT(close, seen * 93 / 100) << c.east << ' ' << c.north << ' ' << c.y << ' ' << seen;
  }
}

}  // namespace
}  // namespace cordillera::pipeline::faces
