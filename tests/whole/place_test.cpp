// Places where lattices break: the antimeridian, the poles, far projections. And rough ground on many seeds.
#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

#include "pipeline/build/build.h"
#include "pipeline/check/check.h"
#include "tests/whole/dem.h"
#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;
using testing::Le;
using testing::Optional;

class Rough : public testing::TestWithParam<int> {};
TEST_P(Rough, obeys_the_laws) {
  const int seed = GetParam();
  const Corner corner{11 + seed % 3, 2000 * kTile + 37 * seed, 1100 * kTile + 91 * seed};
  const double error = std::ldexp(1.0, seed % 5);
  const Built built =
      build_dem(points_of(corner, 500 - 13 * seed, 300 + 17 * seed, rough(static_cast<std::uint32_t>(seed))), with_error(error));
  EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty());
}
INSTANTIATE_TEST_SUITE_P(place, Rough, testing::Range(1, 7));

TEST(place, over_the_antimeridian) {
  // 512 + 300 columns at level 10; both sides of the line must meet on every level, level 0 included.
  const std::int64_t circle = 2 * kTile << 10;
  const Corner corner{10, circle - 300, 600 * kTile + 100};
  const HeightOf ground = rough(21);
  const Built built = build_dem(points_of(corner, 600, 250, ground), with_error(10));
  ASSERT_EQ(built.lattice.finest_level, 10);
  EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty());
  EXPECT_THAT(error_at(built, 10, 0, corner.north - 120, ground(300, 120)), Optional(Le(10.001)));
  EXPECT_EQ(built.levels.at(0).size(), 2u);
}

/// A CRS, and a strategy.
class Pole : public testing::TestWithParam<std::tuple<std::string, std::string>> {
 protected:
  static const std::string& crs() { return std::get<0>(GetParam()); }
  static proto::BuildOptions with_error(double error_m) {
    proto::BuildOptions options = whole::with_error(error_m);
    options.set_strategy(std::get<1>(GetParam()));
    return options;
  }
};
TEST_P(Pole, is_one_point) {
  // 120 x 120 pixels of 500 m around the pole; the pole is a corner of the four middle pixels.
  const bool north = crs() == "EPSG:3413";
  Dem dem;
  dem.columns = dem.rows = 120;
  dem.geotransform = {-30000, 500, 0, 30000, 0, -500};
  dem.crs = crs();
  dem.height = [](int c, int r) {
    return 2000 + 300 * std::cos(0.1 * c) * std::sin(0.13 * r) - 0.2 * std::hypot(c - 59.5, r - 59.5);
  };
  proto::BuildOptions options = with_error(20);
  options.set_max_level(6);
  const Built built = build_dem(dem, options);
  EXPECT_THAT(judge(built, {20000, 0}), IsEmpty());
  const std::int64_t row = north ? built.lattice.rows() : 0;
  for (const auto& [z, level] : built.levels) {
    std::optional<std::int32_t> height;
    for (const auto& [at, tile] : level) {
      for (std::size_t k = 0; k < tile.drc.u.size(); ++k) {
        if (built.lattice.south(at) + tile.drc.v[k] != row) continue;
        EXPECT_EQ(height.value_or(tile.drc.h[k]), tile.drc.h[k]) << "level " << z;
        height = tile.drc.h[k];
      }
    }
    EXPECT_TRUE(height.has_value()) << "level " << z;
  }
}
/// 2,400 km across, relief and noise: parallels turn within a triangle, and each vertex matters.
Dem cap(const std::string& crs) {
  Dem dem;
  dem.columns = dem.rows = 120;
  dem.geotransform = {-1200000, 20000, 0, 1200000, 0, -20000};
  dem.crs = crs;
  const HeightOf noise = rough(5);
  dem.height = [noise](int c, int r) {
    return 1500 + 1500 * std::sin(0.07 * c + 0.02 * r) * std::cos(0.06 * r - 0.01 * c) + 0.1 * noise(c, r);
  };
  return dem;
}
TEST_P(Pole, nothing_is_upside_down_on_a_cap) {
  EXPECT_THAT(judge(build_dem(cap(crs()), with_error(60)), {20000, 0}), IsEmpty());
}

TEST_P(Pole, nothing_is_upside_down_where_each_pixel_is_another) {
  // 72 km across, 2 km a pixel: columns of the lattice are up to 160 times as close as its rows, and vertices at any of them
  // would make needles.
  Dem dem;
  dem.columns = dem.rows = 36;
  dem.geotransform = {-36000, 2000, 0, 36000, 0, -2000};
  dem.crs = crs();
  const HeightOf noise = rough(31);
  dem.height = [noise](int c, int r) { return 600 + 200 * std::sin(0.2 * c) * std::cos(0.15 * r) + noise(c, r); };
  proto::BuildOptions options;
  options.set_strategy(std::get<1>(GetParam()));
  EXPECT_THAT(judge(build_dem(dem, options), {20000, 0}), IsEmpty());
}

/// Builds it, and looks for faults beside its raster.
proto::Manifest sound(const Dem& dem, const proto::BuildOptions& options, const Folder& folder,
                      unsigned measured_more_than = 10) {
  write(dem, folder.path("dem.tif"));
  pipeline::BuildRequest request;
  request.raster_path = folder.path("dem.tif");
  request.raster_name = "dem.tif";
  request.id = "made";
  request.store_path = folder.path("made.sqlite");
  request.options = options;
  request.options.set_vertical_datum("ellipsoid");
  const std::atomic<bool> stop = false;
  const auto built = pipeline::build(request, nullptr, stop);
  if (!built.ok()) throw std::runtime_error(built.problem().line());
  const auto report = pipeline::check::check_store(request.store_path, [&](const proto::Manifest& manifest) {
    pipeline::BuildRequest as_it_was = request;
    as_it_was.options = manifest.options();
    return pipeline::open_source(as_it_was);
  });
  if (!report.ok()) throw std::runtime_error(report.problem().line());
  for (const auto& finding : report->findings.kept()) ADD_FAILURE() << finding.where << ": " << finding.what;
  EXPECT_EQ(report->unmeasured, 0u);
  EXPECT_GT(report->measured, measured_more_than);
  return *built;
}
TEST_P(Pole, a_cap_is_sound_beside_its_raster) { sound(cap(crs()), with_error(60), Folder()); }

// Columns are far closer than pixels of this raster are long, and each of its columns is another one.
TEST(place, a_plate_up_to_a_pole) {
  Dem dem;
  dem.columns = dem.rows = 100;
  dem.geotransform = {10, 0.1, 0, 90, 0, -0.1};
  const HeightOf noise = rough(9);
  dem.height = [noise](int c, int r) { return 3000 + noise(c, r) + 300 * std::sin(2.0 * c); };
  EXPECT_THAT(judge(build_dem(dem, with_error(60)), {20000, 0}), IsEmpty());
}

/// A triangle with two corners at the pole is a line in space. Beside voids a vertex may have no other, and then the .glb has
/// none.
TEST(place, voids_up_to_a_pole) {
  Dem dem;
  dem.columns = 720, dem.rows = 8;
  dem.geotransform = {-180, 0.5, 0, 90, 0, -0.5};
  dem.height = [](int c, int r) {
    const int scattered = (c * 37 + r * 101) * 7919 % 97;
    return scattered < (r == 0 ? 20 : 48) ? kNoData : 300 * std::sin(c / 9.0) * r / 8 + 50 * std::cos(r / 3.0);
  };
  proto::BuildOptions options = with_error(600);
  options.set_voids("hole");
  sound(dem, options, Folder(), 1);
}

INSTANTIATE_TEST_SUITE_P(place, Pole,
                         testing::Combine(testing::Values("EPSG:3413", "EPSG:3031"), testing::Values("cleap", "exact")));

/// Hills of all sizes that go around without a seam.
HeightOf hills_of_the_earth() {
  return [](int c, int r) {
    const double lon = (c + 0.5) * 2 * std::numbers::pi / 1440, lat = (0.5 - (r + 0.5) / 720) * std::numbers::pi;
    const double x = std::cos(lat) * std::cos(lon), y = std::cos(lat) * std::sin(lon), z = std::sin(lat);
    double height = 0, scale = 3, relief = 1500;
    for (int k = 0; k < 7; ++k, scale *= 2.1, relief *= 0.55)
      height += relief * std::sin(scale * x + k) * std::cos(scale * y + 2 * k) * std::cos(scale * z);
    return height;
  };
}

// A world's grid, the most usual raster that has poles: two roots that meet twice. All pixels are seen, up to both poles.
TEST(place, the_whole_earth) {
  Dem dem;
  dem.columns = 1440;
  dem.rows = 720;
  dem.geotransform = {-180, 0.25, 0, 90, 0, -0.25};
  dem.height = hills_of_the_earth();
  const Folder folder;
  const proto::Manifest earth = sound(dem, {}, folder);
  EXPECT_EQ(earth.options().strategy(), "exact");
  EXPECT_EQ(earth.tiles(), 2u + 8 + 32);
  const proto::ErrorAtPixels& pixels = earth.source().error_at_pixels();
  EXPECT_EQ(pixels.pixels(), 1440 * 720);
  EXPECT_EQ(pixels.uncovered(), 0);
  for (const proto::LevelSummary& level : earth.levels()) EXPECT_LE(level.stated_max_error(), level.target()) << level.level();
  EXPECT_LE(pixels.max(), earth.levels(0).target());
}

// A pixel of it is a metre wide at the centre, and a cell of the lattice as narrow.
TEST(place, fine_pixels_beside_a_pole) {
  const HeightOf noise = rough(9);
  Dem dem{30, 20, {10, 0.01, 0, 90, 0, -0.01}, [noise](int c, int r) { return noise(c, r); }};
  const proto::Manifest made = sound(dem, {}, Folder(), 7);
  EXPECT_EQ(made.max_level(), 7u);
  EXPECT_GE(made.levels(0).target(), 0.99 * proto::cell_height_m({7}, 0) / 64);
}

// Its pixels lie on edges of triangles that are flat, while the earth is round.
TEST(place, the_whole_earth_in_few_pixels) {
  Dem dem;
  dem.columns = 36;
  dem.rows = 18;
  dem.geotransform = {-180, 10, 0, 90, 0, -10};
  dem.height = [hills = hills_of_the_earth()](int c, int r) { return hills(40 * c + 20, 40 * r + 20); };
  sound(dem, {}, Folder(), 1);
}

// Vertices of coarse levels are above the greatest height that a raster may have.
TEST(place, heights_near_the_greatest) {
  const HeightOf noise = rough(200);
  Dem dem{120,
          120,
          {500000, 10, 0, 5200000, 0, -10},
          [noise](int c, int r) { return 16383 - std::abs(noise(c, r) - 600); },
          "EPSG:32632"};
  sound(dem, {}, Folder());
}

TEST(place, rotated_in_utm) {
  // 200 x 150 pixels of 30 m, turned by 25 degrees.
  const double turn = 25 * std::numbers::pi / 180, s = 30 * std::sin(turn), c = 30 * std::cos(turn);
  Dem dem;
  dem.columns = 200;
  dem.rows = 150;
  dem.geotransform = {500000, c, s, 4500000, s, -c};
  dem.crs = "EPSG:32633";
  dem.height = rough(33);
  const Built built = build_dem(dem, with_error(8));
  EXPECT_THAT(judge(built, {70000, 1.25}), IsEmpty());
  // 500 km east in zone 33 is 15 degrees east; a place well inside, and one in the corner that turning left empty.
  const double metres_a_degree = 111000;
  const auto column = [&](double east_m) {
    return std::llround((180 + 15 + east_m / (metres_a_degree * std::cos(40.65 * std::numbers::pi / 180))) /
                        built.lattice.cell_deg());
  };
  const auto row = [&](double north_m) {
    return std::llround((90 + 40.650) / built.lattice.cell_deg() + north_m / metres_a_degree / built.lattice.cell_deg());
  };
  EXPECT_TRUE(covered(built, built.lattice.finest_level, column(3600), row(-600)));
  EXPECT_FALSE(covered(built, built.lattice.finest_level, column(300), row(1800)));
}

}  // namespace
}  // namespace cordillera::whole
