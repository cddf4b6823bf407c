// A raster far from where its CRS is used has the wrong one, mostly: that is told, and what may be right is never refused.
#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/place/area_of_use.h"

namespace cordillera::raster_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class AreaOfUse : public RasterTest {
 protected:
  std::string at(const std::string& crs, double x, double y, double pixel) const {
    Spec spec;
    spec.crs = crs;
    spec.geotransform = {x, pixel, 0, y, 0, -pixel};
    return write(spec);
  }
  /// What is noted of it.
  std::vector<std::string> notes(const std::string& crs, double x, double y, double pixel = 30) const {
    const auto source = must_open(at(crs, x, y, pixel));
    if (!source) return {"refused"};
    EXPECT_FALSE(source->description().datum_ignored()) << crs;
    const auto& notes = source->description().notes();
    return {notes.begin(), notes.end()};
  }
};

// Coordinates of UTM zone 32, read in systems of other countries.
constexpr double kUtmEast_m = 356000, kUtmNorth_m = 5699500;

TEST_F(AreaOfUse, ACrsOfAnotherCountryIsRefusedWhereItLiesThousandsOfKilometresAway) {
  for (const char* wrong : {"EPSG:2056", "EPSG:27700", "EPSG:28992", "EPSG:31287", "EPSG:5186"})
    EXPECT_EQ(problem_type(at(wrong, kUtmEast_m, kUtmNorth_m, 1)), "crs-mismatch") << wrong;
  const auto refused = open(at("EPSG:2056", kUtmEast_m, kUtmNorth_m, 1));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().detail,
            "dem.tif lies outside the area of use of CH1903+ / LV95 (EPSG:2056) (5.96 E to 10.49 E, 45.82 N to 47.81 N): at "
            "69.03 W, 73.69 N");
  EXPECT_THAT(refused.problem().accepted, HasSubstr("gdal_translate -a_srs EPSG:CODE dem.tif dem-2.tif"));
  Spec bare;
  bare.crs = "";
  bare.geotransform = {kUtmEast_m, 1, 0, kUtmNorth_m, 0, -1};
  auto options = plain_options();
  options.set_crs("EPSG:2056");
  const auto asked = open(write(bare), options);
  ASSERT_FALSE(asked.ok());
  EXPECT_EQ(asked.problem().type, "crs-mismatch");
  EXPECT_EQ(asked.problem().parameter, "crs");
}

/// Krovak's axes point south and west; maps with them turned round have the same numbers below zero.
TEST_F(AreaOfUse, WhereNoPlaceLeadsBackItIsRefusedToo) {
  EXPECT_EQ(problem_type(at("EPSG:5514", -600000, -1100000, 25)), "");
  EXPECT_EQ(problem_type(at("EPSG:5513", -600000, -1100000, 25)), "crs-mismatch");
  EXPECT_EQ(problem_type(at("EPSG:2065", -600000, -1100000, 25)), "crs-mismatch");
}

TEST_F(AreaOfUse, NearerItIsNoted) {
  for (const char* wrong : {"EPSG:3035", "EPSG:3978", "EPSG:2154"})
    EXPECT_THAT(notes(wrong, kUtmEast_m, kUtmNorth_m, 1), ElementsAre(HasSubstr("lies outside the area of use of"))) << wrong;
  EXPECT_THAT(
      notes("EPSG:2154", kUtmEast_m, kUtmNorth_m, 1),
      ElementsAre("dem.tif lies outside the area of use of RGF93 v1 / Lambert-93 (EPSG:2154) (9.86 W to 10.38 E, 41.15 N to "
                  "51.56 N): at 0.90 W, 38.34 N; is the CRS right?"));
}

// PROJ has no operation for the place itself, and would read the datum as WGS 84, 145 m away.
TEST_F(AreaOfUse, BesideItsDatumIsStillKnown) {
  const auto source = must_open(at("EPSG:2056", 2960000, 1200000, 1));
  ASSERT_TRUE(source);
  EXPECT_FALSE(source->description().datum_ignored());
  EXPECT_NEAR(source->description().bbox(0), 12.161922, 2e-5);
  EXPECT_NEAR(source->description().bbox(3), 46.853575, 2e-5);
  EXPECT_THAT(notes("EPSG:2056", 2960000, 1200000, 1), ElementsAre(HasSubstr("at 12.16 E, 46.85 N; is the CRS right?")));
}

TEST_F(AreaOfUse, WhatMayBeRightIsNeverRefused) {
  struct Case {
    const char* crs;
    double x, y, pixel;
  };
  // Degrees are degrees; x is longitude; a map around a pole goes as far as one likes.
  for (const Case& far :
       {Case{"EPSG:4269", -170.7, -14.3, 0.001}, Case{"EPSG:3832", -14000000, 6000000, 30}, Case{"EPSG:3413", 8000000, 0, 1000}})
    EXPECT_THAT(notes(far.crs, far.x, far.y, far.pixel), ElementsAre(HasSubstr("is the CRS right?"))) << far.crs;
}

TEST_F(AreaOfUse, WhatIsUsualIsNotNoted) {
  EXPECT_THAT(notes("EPSG:4326", 10, 45, 0.001), IsEmpty());
  EXPECT_THAT(notes("EPSG:3857", -20037508, 6000000), IsEmpty());
  EXPECT_THAT(notes("EPSG:2056", 2600000, 1200000), IsEmpty());
  EXPECT_THAT(notes("EPSG:32719", 300000, 7000000), IsEmpty());
  EXPECT_THAT(notes("EPSG:32619", 300000, -2500000), IsEmpty()) << "Landsat's zones are of the northern hemisphere everywhere";
  EXPECT_THAT(notes("EPSG:25832", 900000, 5700000), IsEmpty()) << "the zone beside it";
  EXPECT_THAT(notes("EPSG:31467", 3900000, 5650000), IsEmpty()) << "Germany's east in its third zone";
  EXPECT_THAT(notes("EPSG:3031", 2301440, 495688), IsEmpty());
  EXPECT_THAT(notes("EPSG:3413", -40000, 40000, 1000), IsEmpty());
  EXPECT_THAT(notes("EPSG:3035", 6400000, 3600000), IsEmpty()) << "east of the European Union";
  EXPECT_THAT(notes("EPSG:3994", 7100000, -4000000), IsEmpty()) << "over the antimeridian";
  EXPECT_THAT(notes("+proj=laea +lat_0=47 +lon_0=9 +datum=WGS84 +units=m +no_defs", 20000, 30000), IsEmpty()) << "no area";
}

TEST_F(AreaOfUse, AVerticalPartDoesNotHideIt) {
  EXPECT_EQ(problem_type(at("EPSG:2056+5773", kUtmEast_m, kUtmNorth_m, 1)), "crs-mismatch");
}

TEST_F(AreaOfUse, DistancesKnowTheAntimeridianAndThePoles) {
  const raster::Area pacific{155, -60, 190, -25}, swiss{5.96, 45.82, 10.49, 47.81}, north{-180, 60, 180, 90};
  EXPECT_NEAR(raster::degrees_away(pacific, -175, -40), 0, 1e-9);
  EXPECT_NEAR(raster::degrees_away(pacific, 545, -40), 0, 1e-9);
  EXPECT_NEAR(raster::degrees_away(pacific, -169, -25), 0.906, 0.001);
  EXPECT_NEAR(raster::degrees_away(pacific, 170, 0), 25, 1e-9);
  EXPECT_NEAR(raster::degrees_away(swiss, 188, 80), 180 - 80 - 47.81, 0.1);
  EXPECT_NEAR(raster::degrees_away(north, 30, 31), 29, 1e-9);
  EXPECT_EQ(raster::area_text(pacific), "155.00 E to 170.00 W, 60.00 S to 25.00 S");
}

// As GEOTIFFs of American counties come: the map in feet, and not a word on the heights.
TEST_F(AreaOfUse, HeightsOfAMapInFeetAreNotedToBeTakenAsMetres) {
  const char* const note =
      "Heights are taken as metres, for nothing states their unit; the CRS counts in US survey feet: if the heights do, "
      "z_scale=0.3048006096";
  EXPECT_THAT(notes("EPSG:2248", 1296399, 417474, 10), ElementsAre(note));
  Spec spec;
  spec.crs = "EPSG:2248", spec.geotransform = {1296399, 10, 0, 417474, 0, -10};
  auto options = plain_options();
  options.set_z_scale(1);
  EXPECT_THAT(must_open(write(spec), options)->description().notes(), IsEmpty());
  spec.unit = "m";
  EXPECT_THAT(must_open(write(spec))->description().notes(), IsEmpty());
}

}  // namespace
}  // namespace cordillera::raster_test
