// From line to line of contours: what zooms and relief make of it.
#include "pipeline/contours/interval.h"

#include <gtest/gtest.h>

namespace cordillera::pipeline::contours {
namespace {

constexpr double kMountains_m = 4000;

TEST(Interval, IsSmallOnFlatGround) {
  EXPECT_EQ(usual_interval(12, 250).mm, 50'000);
  EXPECT_EQ(usual_interval(12, 249).mm, 20'000);
  EXPECT_EQ(usual_interval(12, 30).mm, 10'000) << "the least that the zoom allows";
  EXPECT_EQ(usual_interval(14, 30).mm, 5'000);
  EXPECT_EQ(usual_interval(14, 3).mm, 2'000);
  EXPECT_EQ(usual_interval(16, 0).mm, 1'000);
  EXPECT_EQ(usual_interval(14, 8000).mm, 10'000);
}

TEST(Interval, IsAMultipleWhereAZoomWantsIt) {
  EXPECT_EQ(at_zoom({20'000}, 15).mm, 20'000);
  EXPECT_EQ(at_zoom({20'000}, 10).mm, 100'000);
  EXPECT_EQ(at_zoom({1'000}, 0).mm, 100'000);
  EXPECT_EQ(at_zoom({12'192}, 12).mm, 12'192);
  EXPECT_EQ(at_zoom({12'192}, 11).mm, 24'384);
  for (int zoom = 0; zoom <= 22; ++zoom) {
    EXPECT_LE(4 * least_interval(zoom).mm, usual_interval(zoom, kMountains_m).mm) << zoom;
    for (const double relief_m : {0.0, 30.0, 300.0, kMountains_m}) {
      EXPECT_LE(usual_interval(zoom + 1, relief_m).mm, usual_interval(zoom, relief_m).mm);
      EXPECT_GE(usual_interval(zoom, relief_m).mm, least_interval(zoom).mm);
    }
  }
  EXPECT_EQ(index_of(0), 10);
  EXPECT_EQ(index_of(-15), 5);
  EXPECT_EQ(index_of(-4), 2);
  EXPECT_EQ(index_of(7), 1);
}

}  // namespace
}  // namespace cordillera::pipeline::contours
