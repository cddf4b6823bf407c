// How far the lattice is from the source's own pixels, where the answer is known.
#include "raster/resampling_error.h"

#include <algorithm>
#include <cmath>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

using ResamplingError = RasterTest;

constexpr int kLevel = 8;

/// 16 x 16 pixels as large as the cells of kLevel; the first pixel's north-western corner dx east and dy south of a vertex, in cells.
Spec beside_lattice(double dx, double dy) {
  Spec spec;
  spec.columns = spec.rows = 16;
  spec.geotransform = cells_of(kLevel, 70000, 50000);
  spec.geotransform[0] += dx * spec.geotransform[1];
  spec.geotransform[3] += dy * spec.geotransform[5];
  return spec;
}

Spec spike_at(Spec spec, int column, int row) {
  spec.value = [=](int c, int r) { return c == column && r == row ? 100.0 : 0.0; };
  return spec;
}

double error_m(const std::string& file, const proto::BuildOptions& options = plain_options(), int level = kLevel) {
  const auto source = must_open(file, options);
  if (!source) return std::nan("");
  const double error = source->resampling_error_m(lattice(level));
  EXPECT_EQ(error, source->resampling_error_m(lattice(level)));
  return error;
}

TEST_F(ResamplingError, PlaneHasNoneButAtItsRim) {
  Spec spec = beside_lattice(0.3, 0.4);
  spec.point = true;
  spec.value = [](int c, int r) { return 1000 + 3.25 * c - 7.5 * r; };
  EXPECT_LT(error_m(write(spec)), 0.001);
  EXPECT_LT(error_m(write(spec), plain_options(), kLevel + 2), 0.001);
  // Areas reach half a pixel beyond the outermost centres, and level there: a tenth of 7.5 m lost at the southern vertices, nine tenths of
  // which arrive at the last centres.
  spec.point = false;
  EXPECT_NEAR(error_m(write(spec)), 0.675, 0.001);
}

TEST_F(ResamplingError, UnitScaleAndDatumAreThoseOfSamples) {
  Spec spec = beside_lattice(0.3, 0.4);
  spec.point = true;
  spec.unit = "ft", spec.scale = 0.5, spec.offset = 12;
  spec.value = [](int c, int r) { return 1000 + 3.25 * c - 7.5 * r; };
  proto::BuildOptions options = plain_options();
  options.set_vertical_datum("EGM96");
  options.set_z_scale(2), options.set_z_offset(-100);
  EXPECT_LT(error_m(write(spec), options), 0.01);  // the geoid is tens of metres up here, and nearly a plane within a cell
}

TEST_F(ResamplingError, SpikeBesideTheLattice) {
  // In the middle of a cell: a quarter of it at each of four vertices.
  EXPECT_NEAR(error_m(write(spike_at(beside_lattice(0, 0), 8, 8))), 75, 0.002);
  // A quarter cell from the south-eastern vertex: 18.75, 56.25, 6.25, 18.75 (SW, SE, NW, NE), 37.5 on the south-eastern triangle.
  EXPECT_NEAR(error_m(write(spike_at(beside_lattice(0.25, 0.25), 8, 8))), 62.5, 0.002);
  // The same beside the north-western vertex, on the other triangle.
  EXPECT_NEAR(error_m(write(spike_at(beside_lattice(-0.25, -0.25), 8, 8))), 62.5, 0.002);
  EXPECT_NEAR(error_m(write(spike_at(beside_lattice(0.5, 0.5), 8, 8))), 0, 0.002);  // on a vertex
}

TEST_F(ResamplingError, OnlyWhatTheTilesShow) {
  const std::string file = write(spike_at(beside_lattice(0, 0), 3, 3));
  const proto::Lattice l = lattice(kLevel);
  proto::BuildOptions options = plain_options();
  for (const double v : {l.longitude_deg(70008), l.latitude_deg(50000 - 14), l.longitude_deg(70014), l.latitude_deg(50000 - 8)}) options.add_bbox(v);
  EXPECT_EQ(error_m(file, options), 0);
  Spec wide = spike_at(beside_lattice(0, 0), 11, 11);
  wide.columns = wide.rows = 1000;
  EXPECT_NEAR(error_m(write(wide), options), 75, 0.002);  // every pixel under a small bbox is asked, however large the raster
  Spec torn = spike_at(beside_lattice(0, 0), 8, 8);
  torn.nodata = -1;
  torn.value = [](int c, int r) { return c == 8 && r == 8 ? 100.0 : c >= 6 && c <= 9 && r >= 6 && r <= 10 ? -1 : 0; };
  EXPECT_NEAR(error_m(write(torn)), 0, 0.001);  // alone among voids the spike is exact
  options = plain_options();
  options.set_voids("0");
  torn.value = [](int c, int r) { return c == 8 && r == 8 ? 100.0 : -1; };
  EXPECT_NEAR(error_m(write(torn), options), 75, 0.002);  // a number put into voids is a height
}

TEST_F(ResamplingError, Utm) {
  Spec spec;
  spec.columns = spec.rows = 60;
  spec.crs = "EPSG:32611";
  spec.point = true;
  spec.geotransform = {400000, 30, 0, 3800000, 0, -30};
  spec.value = [](int c, int r) { return 500 + 2.0 * c - 3.0 * r; };
  EXPECT_LT(error_m(write(spec), plain_options(), 12), 0.05);
  // Cells of 9 m under pixels of 30 m: the surface is near the spike's top, but seldom on it.
  const double spike = error_m(write(spike_at(spec, 31, 22)), plain_options(), 13);
  EXPECT_GT(spike, 1);
  EXPECT_LT(spike, 35);
}

TEST_F(ResamplingError, AroundTheEarth) {
  Spec spec;
  spec.columns = 36, spec.rows = 18;
  spec.geotransform = {-180, 10, 0, 90, 0, -10};
  spec.value = [](int c, int) { return c == 35 ? 100.0 : 0.0; };
  EXPECT_NEAR(error_m(write(spec), plain_options(), 2), 0.868, 0.001);  // the ridge at 175 E lies between vertices 0.176 degrees apart
}

TEST(PixelNet, EvenAndBounded) {
  const raster::PixelNet small = raster::spread_net({5, 7, 30, 20, 6, 6, 256, 256});
  ASSERT_EQ(small.columns.size(), 30u);
  ASSERT_EQ(small.rows.size(), 20u);
  EXPECT_EQ(small.columns.front(), 5);
  EXPECT_EQ(small.rows.back(), 26);
  const raster::NetFrame frames[] = {{0, 0, 3601, 3601, 6, 6, 3601, 1},     {0, 0, 100000, 80000, 6, 6, 256, 256}, {0, 0, 1, 1000000, 6, 6, 1, 64},
                                     {0, 0, 90000, 90000, 6, 6, 90000, 16}, {9, 9, 5000, 5000, 206, 206, 512, 512}, {0, 0, 1, 1, 6, 6, 1, 1},
                                     {0, 0, 5000, 5000, 100000, 100000, 256, 256}};
  for (const raster::NetFrame& f : frames) {
    const raster::PixelNet net = raster::spread_net(f);
    const auto check = [](const std::vector<std::int64_t>& v, std::int64_t first, std::int64_t size) {
      ASSERT_FALSE(v.empty());
      EXPECT_TRUE(std::adjacent_find(v.begin(), v.end(), std::greater_equal<>()) == v.end());  // ascending, none twice
      EXPECT_GE(v.front(), first);
      EXPECT_LT(v.back(), first + size);
      if (v.size() < 4) return;
      EXPECT_LT(v.front(), first + size / 2);
      EXPECT_GE(v.back(), first + size / 2);
    };
    check(net.columns, f.x, f.columns);
    check(net.rows, f.y, f.rows);
    const auto pixels = static_cast<std::int64_t>(net.columns.size() * net.rows.size());
    EXPECT_LE(pixels, raster::kNetPixels);
    EXPECT_TRUE(pixels == 1 || pixels * f.window_columns * f.window_rows <= raster::kNetCost_px);
  }
}

}  // namespace
}  // namespace cordillera::raster_test
