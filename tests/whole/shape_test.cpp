// Shapes whose right answer one can draw by hand, the whole way: raster, build, store, decode, judge.
#include <gmock/gmock.h>

#include <cmath>

#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::IsEmpty;
using testing::Le;
using testing::Optional;

/// A corner of tile (x, y) of a level, y from the south, in lattice vertices: its north-western one.
Corner north_west_of(const proto::TileAddress& t) { return {t.z, t.x * kTile, (t.y + 1) * kTile}; }

TEST(shape, a_plane_is_two_triangles_a_tile) {
  // 2 x 2 tiles of 1.2 km: chords sag 3 cm over a tile's side, 6 cm over its diagonal.
  const auto tilted = [](int c, int r) { return 500 + 0.25 * c - 0.5 * r; };
  const Built built =
      build_dem(points_of(north_west_of({14, 17000, 12000}), 2 * kTile + 1, 2 * kTile + 1, tilted), with_error(1));
  ASSERT_EQ(built.lattice.finest_level, 14);
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  ASSERT_EQ(built.finest().size(), 4u);
  for (const auto& [at, tile] : built.finest()) EXPECT_EQ(tile.drc.triangles.size(), 2u) << at.x << " " << at.y;
  for (const auto& [z, level] : built.levels) EXPECT_LE(built.triangles(z), 8u) << "level " << z;
}

TEST(shape, a_cone_keeps_its_top_and_its_round_foot) {
  const auto cone = [](int c, int r) { return std::max(0.0, 400 - 4 * std::hypot(c - 128, r - 128)); };
  const Corner corner = north_west_of({13, 9000, 6000});
  const Built built = build_dem(points_of(corner, 257, 257, cone), with_error(2));
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  for (const auto& [z, level] : built.levels)
    EXPECT_THAT(error_at(built, z, corner.west + 128, corner.north - 128, 400), Optional(Le(built.stated_m(z)))) << "level " << z;
  EXPECT_LT(built.triangles(13), 2 * kTile * kTile / 50);
}

TEST(shape, a_sphere_cap) {
  const auto cap = [](int c, int r) { return std::sqrt(1e6 - std::pow(c - 100, 2) * 20 - std::pow(r - 100, 2) * 20); };
  const Built built = build_dem(points_of({13, 9000 * kTile + 50, 6000 * kTile + 300}, 201, 201, cap), with_error(0.5));
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  EXPECT_LT(built.triangles(13), 4000u);
}

TEST(shape, a_step_stays_where_it_is) {
  // The wall stands between columns 100 and 101; away from it the tile needs no vertex.
  const Corner corner = north_west_of({13, 9000, 6000});
  const Built built = build_dem(points_of(corner, 257, 257, [](int c, int) { return c <= 100 ? 0.0 : 80.0; }), with_error(1));
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  for (std::int64_t r : {3, 77, 200}) {
    EXPECT_THAT(error_at(built, 13, corner.west + 100, corner.north - r, 0), Optional(Le(1.0)));
    EXPECT_THAT(error_at(built, 13, corner.west + 101, corner.north - r, 80), Optional(Le(1.0)));
  }
}

TEST(shape, a_spike_is_kept_until_the_target_passes_it) {
  const Corner corner = north_west_of({13, 9000, 6000});
  const Built built =
      build_dem(points_of(corner, 257, 257, [](int c, int r) { return c == 90 && r == 41 ? 500.0 : 20.0; }), with_error(1));
  // What it is off beside the needles of the spike is known to some centimetres only: they are as steep as 1000 to 1.
  EXPECT_THAT(judge(built, {kAllSamples.samples_a_tile, 1.5}), IsEmpty());
  EXPECT_THAT(error_at(built, 13, corner.west + 90, corner.north - 41, 500), Optional(Le(1.0)));
  EXPECT_THAT(error_at(built, 8, corner.west + 90, corner.north - 41, 500), Optional(Le(32.0)));
  EXPECT_LT(built.triangles(13), 200u);
}

TEST(shape, a_sea_follows_the_geoid) {
  proto::BuildOptions options = with_error(0.05);
  options.set_vertical_datum("EGM96");
  options.set_max_level(7);
  Dem dem = points_of({7, 127 * kTile, 64 * kTile}, 301, 301, [](int, int) { return 0.0; });
  const Built built = build_dem(dem, options);
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  // The geoid's height at 0.466744 S 0.0023 E, from NGA's own test points for EGM96.
  const std::int64_t i = std::llround((180 + 0.0023) / built.lattice.cell_deg()),
                     j = std::llround((90 - 0.466744) / built.lattice.cell_deg());
  EXPECT_THAT(error_at(built, 7, i, j, 17.329), Optional(Le(0.15)));
}

TEST(shape, coarse_levels_see_the_earths_curvature) {
  // A sea of 22.5 by 22.5 degrees: one chord over it would pass 120 km below the surface.
  const Built loose = build_dem(points_of({4, 9 * kTile, 9 * kTile}, 513, 513, [](int, int) { return 0.0; }), with_error(1e5));
  EXPECT_THAT(judge(loose, {5000, 0}), IsEmpty());
  EXPECT_GT(loose.stated_m(0), 10000);
  const Built tight = build_dem(points_of({4, 9 * kTile, 9 * kTile}, 513, 513, [](int, int) { return 0.0; }), with_error(100));
  EXPECT_THAT(judge(tight, {5000, 0}), IsEmpty());
  EXPECT_LE(tight.stated_m(0), 1600);
  EXPECT_GT(tight.triangles(0), loose.triangles(0));
}

TEST(shape, one_tile_exactly) {
  const Built built = build_dem(points_of(north_west_of({12, 4000, 2900}), 257, 257, rough(5)), with_error(20));
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  EXPECT_EQ(built.finest().size(), 1u);
}

TEST(shape, one_pixel) {
  const Built built =
      build_dem(cells_of({12, 4000 * kTile + 7, 2900 * kTile + 9}, 1, 1, [](int, int) { return 321.0; }), with_error(1));
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  EXPECT_EQ(built.triangles(12), 2u);
  EXPECT_THAT(error_at(built, 12, 4000 * kTile + 7, 2900 * kTile + 9, 321), Optional(Le(0.01)));
}

TEST(shape, two_pixels) {
  const Built built = build_dem(
      cells_of({12, 4000 * kTile + 7, 2900 * kTile + 9}, 2, 1, [](int c, int) { return 100.0 + 10 * c; }), with_error(1));
  EXPECT_THAT(judge(built, kAllSamples), IsEmpty());
  EXPECT_EQ(built.manifest.source().error_at_pixels().pixels(), 2);
  EXPECT_LE(built.manifest.source().error_at_pixels().max(), 1.01);
}

}  // namespace
}  // namespace cordillera::whole
