// The pixel that holds a place, place by place and at the middles of cells; and pixels that several handles share.
#include <gdal_priv.h>

#include <cmath>

#include "fixture.h"
#include "raster/mosaic/mosaic.h"
#include "raster/pixels/shared_pixels.h"

namespace cordillera::raster_test {
namespace {

using Nearest = RasterTest;
using Window = raster::Source::Window;

double stripes(int c, int r) { return 10 * c + 1000 * (r % 30); }

/// Both ways of asking at the middles of cells; by rows from the south.
struct Answers {
  std::vector<double> of_cells, one_by_one;
};
Answers ask(raster::Source& source, const proto::Lattice& lattice, const Window& cells) {
  const auto count = static_cast<std::size_t>((cells.east - cells.west) * (cells.north - cells.south));
  Answers answers{std::vector<double>(count, -1), std::vector<double>(count, -1)};
  std::vector<double> longitude_deg, latitude_deg;
  for (std::int64_t j = cells.south; j < cells.north; ++j) {
    for (std::int64_t i = cells.west; i < cells.east; ++i) {
      longitude_deg.push_back(lattice.longitude_at_deg(static_cast<double>(i) + 0.5));
      latitude_deg.push_back((lattice.latitude_deg(j) + lattice.latitude_deg(j + 1)) / 2);
    }
  }
  EXPECT_TRUE(source.nearest_in_cells(lattice, cells, answers.of_cells.data()).ok());
  EXPECT_TRUE(source.nearest(longitude_deg, latitude_deg, answers.one_by_one.data()).ok());
  return answers;
}

/// The same, with as many heights and voids as `least` at the least.
void expect_same(const Answers& answers, std::ptrdiff_t least) {
  std::ptrdiff_t heights = 0, others = 0, voids = 0;
  for (std::size_t k = 0; k < answers.of_cells.size(); ++k) {
    const double a = answers.of_cells[k], b = answers.one_by_one[k];
    voids += std::isnan(b), heights += !std::isnan(b);
    others += std::isnan(a) != std::isnan(b) || (!std::isnan(a) && a != b);
  }
  EXPECT_EQ(others, 0) << "of " << answers.of_cells.size();
  EXPECT_GE(heights, least);
  EXPECT_GE(voids, least) << "the window is as large as the raster: it does not see beyond its sides";
}

Window around(raster::Source& source, const proto::Lattice& lattice, std::int64_t margin) {
  const Window w = source.window(lattice);
  return {w.west - margin, w.south - margin, w.east + margin, w.north + margin};
}

TEST_F(Nearest, OfCellsIsWhatEachPlaceSays) {
  struct Case {
    const char* crs;
    std::array<double, 6> geotransform;
    int level;
  };
  const Case all[] = {{"EPSG:4326", {10.003, 0.0007, 0, 45.01, 0, -0.0005}, 11},
                      {"EPSG:4326", {179.97, 0.0007, 0, -16, 0, -0.0005}, 11},              // across the antimeridian
                      {"EPSG:4326", {10.003, 0.0007, 0.0001, 45.01, 0.0002, -0.0005}, 11},  // turned
                      {"EPSG:32611", {400000, 30, 0, 3800000, 0, -30}, 12},
                      {"EPSG:3031", {2270000, 100, 0, 580000, 0, -100}, 11}};
  for (const Case& c : all) {
    SCOPED_TRACE(c.crs);
    Spec spec;
    spec.columns = 90, spec.rows = 80;
    spec.crs = c.crs;
    spec.geotransform = c.geotransform;
    spec.nodata = -9999;
    spec.value = [](int x, int y) { return x > 40 && x < 50 && y > 20 && y < 50 ? -9999 : stripes(x, y); };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source);
    expect_same(ask(*source, lattice(c.level), around(*source, lattice(c.level), 6)), 300);
  }
}

TEST_F(Nearest, OfCellsAllAroundTheEarth) {
  Spec spec;
  spec.columns = 360, spec.rows = 100;
  spec.geotransform = {-180, 1, 0, 50, 0, -1};
  spec.value = stripes;
  const auto source = must_open(write(spec));
  const proto::Lattice coarse = lattice(1);
  expect_same(ask(*source, coarse, {coarse.columns() / 2, 0, coarse.columns() * 3 / 2, coarse.rows()}), 1000);
}

TEST_F(Nearest, OfCellsOfAMosaicIsThatOfTheUppermostRasterWithData) {
  const auto member = [&](const std::string& name, double west, double height_m) {
    Spec spec;
    spec.columns = spec.rows = 60;
    spec.geotransform = {west, 0.0007, 0, 45, 0, -0.0005};
    spec.nodata = -9999;
    spec.value = [height_m](int x, int y) { return x > 40 && y > 40 ? -9999 : height_m + x; };
    return raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options()).value();
  };
  const auto source = raster::make_mosaic({member("a.tif", 10, 100), member("b.tif", 10.021, 5000)}, 0);
  const Answers answers = ask(*source, lattice(11), around(*source, lattice(11), 6));
  expect_same(answers, 200);
  EXPECT_TRUE(std::ranges::any_of(answers.of_cells, [](double h) { return h < 200; }));
  EXPECT_TRUE(std::ranges::any_of(answers.of_cells, [](double h) { return h > 4999; }));
}

using raster::PixelWindow;
using raster::SharedPixels;

/// As a raster of which a pixel's value is its place.
std::vector<double> pixels_of(const PixelWindow& w) {
  std::vector<double> heights;
  for (std::int64_t y = w.y; y < w.y + w.rows; ++y)
    for (std::int64_t x = w.x; x < w.x + w.columns; ++x) heights.push_back(static_cast<double>(1000 * y + x));
  return heights;
}

TEST(SharedPixels, AWindowIsReadFromThoseThatCoverItTogether) {
  SharedPixels lately(1 << 20);
  const PixelWindow upper{-5, 0, 100, 20}, lower{0, 18, 100, 20};
  for (const PixelWindow& w : {upper, lower}) lately.keep(1, w, pixels_of(w));
  std::vector<double> heights;
  for (const PixelWindow& inside : {PixelWindow{-5, 0, 100, 20}, PixelWindow{7, 3, 30, 4}, PixelWindow{0, 10, 95, 28}}) {
    ASSERT_TRUE(lately.read(1, inside, heights)) << inside.x << " " << inside.y;
    EXPECT_EQ(heights, pixels_of(inside));
  }
  EXPECT_FALSE(lately.read(1, {-5, 10, 20, 20}, heights)) << "the lower one begins farther east";
  EXPECT_FALSE(lately.read(1, {0, 30, 20, 9}, heights)) << "no window has the last row";
  EXPECT_FALSE(lately.read(2, {7, 3, 30, 4}, heights)) << "another raster";
}

TEST(SharedPixels, TheOldestWindowsMakeRoom) {
  const PixelWindow first{0, 0, 10, 10}, second{0, 10, 10, 10}, third{0, 20, 10, 10}, large{0, 0, 100, 100};
  SharedPixels lately(2 * first.count() * sizeof(double));
  std::vector<double> heights;
  lately.keep(1, first, pixels_of(first));
  lately.keep(1, large, pixels_of(large));  // too large for all of the room
  EXPECT_TRUE(lately.read(1, first, heights));
  lately.keep(1, second, pixels_of(second));
  lately.keep(1, third, pixels_of(third));
  EXPECT_FALSE(lately.read(1, first, heights));
  EXPECT_TRUE(lately.read(1, {0, 10, 10, 20}, heights));
}

TEST_F(Nearest, WhatAHandleHasReadIsNotReadAgainByOthersThatShareIt) {
  Spec spec;
  spec.columns = spec.rows = 600;  // more than is read when it is opened
  const std::string file = write(spec);
  const auto first = must_open(file), second = must_open(file), alone = must_open(file);
  const auto lately = std::make_shared<SharedPixels>(1 << 20);
  first->share_pixels(lately, 0), second->share_pixels(lately, 0);
  const double longitude[] = {12.035}, latitude[] = {40.035};
  double height_m = 0;
  ASSERT_TRUE(first->nearest(longitude, latitude, &height_m).ok());
  EXPECT_EQ(height_m, 100);
  {  // the file changes: nobody who has a dataset built may do that, but it tells who reads
    const GDALDatasetUniquePtr open(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    ASSERT_EQ(open->GetRasterBand(1)->Fill(200), CE_None);
  }
  ASSERT_TRUE(alone->nearest(longitude, latitude, &height_m).ok());
  EXPECT_EQ(height_m, 200);
  ASSERT_TRUE(second->nearest(longitude, latitude, &height_m).ok());
  EXPECT_EQ(height_m, 100);
}

}  // namespace
}  // namespace cordillera::raster_test
