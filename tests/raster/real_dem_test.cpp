// Real elevation models, where they are at hand: they open, they lie where they should, and their heights are those of their
// makers.
#include <cmath>
#include <filesystem>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

class RealDem : public ::testing::Test {
 protected:
  void SetUp() override {
    if (real_dems().empty()) GTEST_SKIP() << "no real elevation models: set CORDILLERA_TEST_DATA";
  }
};

TEST_F(RealDem, AllOpenAndHaveHeights) {
  const struct {
    const char* file;
    int level;
    double west, south, low, high, share;
  } cases[] = {{"srtm1_N48W125.tif", 9, -125, 48, -13, 1095, 0.45},
               {"srtm3_N46E008_voids.tif", 9, 8, 46, 187, 4173, 0.8},
               {"N44W072.hgt", 9, -72, 44, 115, 1908, 0.99},
               {"srtm1_bigtujunga_utm11.tif", 12, -118.35, 34.23, 315, 2295, 0.9},
               {"dom1_32_356_5699_1_nw_2020.tif", 16, 6.928, 51.424, 87, 168, 0.9},
               {"korea_5m_34707051.tif", 14, 127.499, 34.599, 0, 293, 0.9},
               {"swiss_lv95_2m5_cog.tif", 15, 7.0906, 45.916, 1615, 2016, 0.9},
               {"gironde_topobathy.tif", 10, -1.7414, 44.7499, -101, 105, 0.99},
               {"luxembourg_elev.tif", 7, 5.7417, 49.4417, 141, 547, 0.4},
               {"msh_crater_webmercator.tif", 13, -122.207, 46.186, 1361, 2539, 0.9},
               {"cleantopo_tl_uint16.tif", 5, -180, 78.685, 6562, 9690, 0.99},
               {"SainteHelens.dem", 12, -122.2528, 46.1238, 682, 2543, 0.9},
               {"dc_lidar_dtm_ftus_2248.tif", 16, -77.056, 38.808, 6.8, 22.1, 0.9},
               {"etopo1_antimeridian_160_200.tif", 0, 159.5, -60.5, -9120, 1794, 0.99},
               {"vestfold_hills_polar.tif", 12, 77.845, -68.627, 18, 333, 0.3},
               {"glo30_los_angeles_ellipsoid.tif", 12, -118.05, 33.95, 5.7, 387, 0.99}};
  for (const auto& k : cases) {
    SCOPED_TRACE(k.file);
    const std::string file = real_dems() + "/" + k.file;
    if (!std::filesystem::exists(file)) continue;
    for (const raster::Trust trust : {raster::Trust::operator_file, raster::Trust::posted_file}) {
      const auto source = must_open(file, plain_options(), trust, k.file);
      ASSERT_TRUE(source);
      EXPECT_NEAR(source->description().bbox(0), k.west, 0.01);
      EXPECT_NEAR(source->description().bbox(1), k.south, 0.01);
      if (trust == raster::Trust::posted_file) continue;
      const proto::Samples s = whole(*source, lattice(k.level));
      EXPECT_GT(valid_share(s), k.share);
      for (const std::int32_t h : s.height)
        ASSERT_TRUE(h == proto::kNoHeight || (h / 1024.0 >= k.low - 0.01 && h / 1024.0 <= k.high + 0.01)) << h / 1024.0;
    }
  }
}

/// Law 6: two files of the same place, above EGM2008 and above the ellipsoid, agree when the geoid is named.
TEST_F(RealDem, TheLosAngelesPairAgrees) {
  proto::BuildOptions above_geoid;
  above_geoid.set_vertical_datum(real_dems() + "/geoid/egm_08_los_angeles.tif");
  const auto ellipsoidal = must_open(real_dems() + "/glo30_los_angeles_ellipsoid.tif");
  const auto orthometric = must_open(real_dems() + "/glo30_los_angeles_egm2008.tif", above_geoid);
  ASSERT_TRUE(ellipsoidal && orthometric);
  const proto::Samples a = whole(*ellipsoidal, lattice(12)), b = whole(*orthometric, lattice(12));
  ASSERT_EQ(a.height.size(), b.height.size());
  for (std::size_t k = 0; k < a.height.size(); ++k) ASSERT_LE(std::abs(a.height[k] - b.height[k]), 102) << k;
  above_geoid.set_vertical_datum("EGM96");
  const proto::Samples c = whole(*must_open(real_dems() + "/glo30_los_angeles_egm2008.tif", above_geoid), lattice(12));
  for (std::size_t k = 0; k < a.height.size(); ++k) ASSERT_LE(std::abs(a.height[k] - c.height[k]), 2048) << k;
}

TEST_F(RealDem, AGridElsewhereIsRefused) {
  proto::BuildOptions options;
  options.set_vertical_datum(real_dems() + "/geoid/egm_08_los_angeles.tif");
  EXPECT_EQ(problem_type(real_dems() + "/korea_5m_34707051.tif", options), "geoid-does-not-cover");
  options.set_vertical_datum(real_dems() + "/geoid/us_nga_egm84_30.tif");
  EXPECT_EQ(problem_type(real_dems() + "/korea_5m_34707051.tif", options), "");
}

}  // namespace
}  // namespace cordillera::raster_test
