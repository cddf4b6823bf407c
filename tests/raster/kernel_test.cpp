// Resampling: exact where samples coincide, flat stays flat, antialiased when reducing, the same whatever window asks.
#include <cmath>
#include <random>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

double bumpy(int c, int r) {
  return std::nearbyint(1024 * (300 + 40 * std::sin(0.7 * c) + 25 * std::cos(0.9 * r + 0.1 * c))) / 1024;
}

/// Points on the lattice's vertices: pixel (c, r) of a pixel-is-point raster is vertex (west + c, north - r).
Spec point_spec(int level, std::int64_t west, std::int64_t north, int columns, int rows) {
  Spec spec;
  spec.columns = columns, spec.rows = rows, spec.point = true, spec.type = "Float64", spec.value = bumpy;
  const proto::Lattice l = lattice(level);
  spec.geotransform = cells_of(level, west, north);
  spec.geotransform[0] -= l.cell_deg() / 2;
  spec.geotransform[3] += l.cell_deg() / 2;
  return spec;
}

using Kernel = RasterTest;

TEST_F(Kernel, CoincidingSamplesAreExact) {
  const auto source = must_open(write(point_spec(6, 9000, 12000, 40, 30)));
  ASSERT_TRUE(source);
  const auto w = source->window(lattice(6));
  EXPECT_EQ(w.west, 9000);
  EXPECT_EQ(w.east, 9039);
  EXPECT_EQ(w.north, 12000);
  EXPECT_EQ(w.south, 11971);
  const proto::Samples s = whole(*source, lattice(6));
  for (int r = 0; r < 30; ++r)
    for (int c = 0; c < 40; ++c) ASSERT_EQ(s.at(9000 + c, 12000 - r), std::lround(bumpy(c, r) * 1024)) << c << ", " << r;
}

TEST_F(Kernel, BetweenSamplesIsBilinear) {
  const auto source = must_open(write(point_spec(6, 9000, 12000, 40, 30)));
  ASSERT_TRUE(source);
  const double mean = (bumpy(3, 5) + bumpy(4, 5) + bumpy(3, 6) + bumpy(4, 6)) / 4;
  EXPECT_NEAR(height_m(*source, lattice(7), 2 * 9003 + 1, 2 * (12000 - 5) - 1), mean, 0.001);
  EXPECT_NEAR(height_m(*source, lattice(7), 2 * 9003 + 1, 2 * (12000 - 5)), (bumpy(3, 5) + bumpy(4, 5)) / 2, 0.001);
}

TEST_F(Kernel, ReducingWeighsATriangle) {
  const auto source = must_open(write(point_spec(6, 9000, 12000, 60, 60)));
  ASSERT_TRUE(source);
  // Two levels up: half width 4 pixels. By hand, at pixel (20, 24) = vertex (9020, 11976) = (2255, 2994) of level 4.
  double sum = 0, weights = 0;
  for (int dy = -3; dy <= 3; ++dy) {
    for (int dx = -3; dx <= 3; ++dx) {
      const double w = (4 - std::abs(dx)) * (4 - std::abs(dy));
      sum += w * bumpy(20 + dx, 24 + dy), weights += w;
    }
  }
  EXPECT_NEAR(height_m(*source, lattice(4), 2255, 2994), sum / weights, 0.001);
}

TEST_F(Kernel, AFlatSurfaceStaysFlatToTheStep) {
  for (const double height : {0.0, 12.3, -4.56789, 1870.123}) {
    Spec spec = point_spec(6, 9000, 12000, 40, 30);
    spec.value = [height](int, int) { return height; };
    const auto source = must_open(write(spec));
    for (const int level : {5, 6, 8}) {
      const proto::Samples s = whole(*source, lattice(level));
      for (const std::int32_t h : s.height) ASSERT_EQ(h, std::lround(height * 1024));
    }
  }
}

TEST_F(Kernel, EveryWindowGivesTheSameBits) {
  Spec spec = point_spec(6, 9000, 12000, 90, 70);
  spec.nodata = -1;
  spec.value = [](int c, int r) { return (c * 7 + r * 13) % 31 == 0 ? -1.0 : bumpy(c, r); };
  const std::string tables[] = {"", "12.5"};
  std::mt19937 random(1);
  for (const std::string crs : {"EPSG:4326", "EPSG:4269", "EPSG:4267"}) {
    spec.crs = crs;
    const std::string file = write(spec);
    for (const std::string& voids : tables) {
      proto::BuildOptions options = plain_options();
      options.set_voids(voids);
      const auto source = must_open(file, options);
      ASSERT_TRUE(source);
      for (const int level : {4, 6, 7}) {
        const proto::Samples all = whole(*source, lattice(level));
        ASSERT_GT(valid_share(all), 0.5);
        for (int n = 0; n < 40; ++n) {
          const auto c = static_cast<std::int32_t>(random() % all.columns), r = static_cast<std::int32_t>(random() % all.rows);
          const auto columns = static_cast<std::int32_t>(1 + random() % (all.columns - c)),
                     rows = static_cast<std::int32_t>(1 + random() % (all.rows - r));
          auto part = source->sample(lattice(level), all.west + c, all.south + r, columns, rows);
          ASSERT_TRUE(part.ok());
          for (std::int32_t y = 0; y < rows; ++y)
            for (std::int32_t x = 0; x < columns; ++x)
              ASSERT_EQ(part->at(part->west + x, part->south + y), all.at(part->west + x, part->south + y)) << crs << voids;
        }
      }
    }
  }
}

TEST_F(Kernel, ManyPixelsUnderOneSampleAreReadInStrips) {
  Spec spec;
  spec.columns = 6000, spec.rows = 4000, spec.type = "Int16", spec.geotransform = {10, 0.0002, 0, 45, 0, -0.0002};
  spec.value = [](int c, int) { return c; };
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  // A cell of level 0 is 3516 pixels; vertex (271, 191) is 10.546875 E, 44.296875 N: the weighted mean of a ramp, cut at the rim.
  double sum = 0, weights = 0;
  const double u = (10.546875 - 10) / 0.0002 - 0.5, ratio = 180.0 / 256 / 0.0002;
  for (int c = 0; c < 6000; ++c) {
    const double w = std::max(0.0, 1 - std::abs(c - u) / ratio);
    sum += w * c, weights += w;
  }
  EXPECT_NEAR(height_m(*source, lattice(0), 271, 191), sum / weights, 0.01);
}

TEST_F(Kernel, PixelIsAreaCoversItsPixelsToTheRim) {
  Spec spec;
  spec.columns = 4, spec.rows = 3;
  spec.geotransform = cells_of(5, 5000, 6000);
  spec.nodata = -9999;
  spec.value = [](int c, int r) { return c == 1 && r == 1 ? -9999.0 : 10.0 + c; };
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  const proto::Samples s = whole(*source, lattice(5));
  EXPECT_EQ(s.columns, 5);
  EXPECT_EQ(s.rows, 4);
  EXPECT_EQ(valid_share(s), 1.0);  // every vertex touches a valid pixel
  // Twice as fine: the centre of the void pixel is void, and nothing else.
  const proto::Samples fine = whole(*source, lattice(6));
  for (std::int64_t j = fine.south; j < fine.south + fine.rows; ++j)
    for (std::int64_t i = fine.west; i < fine.west + fine.columns; ++i)
      EXPECT_EQ(fine.at(i, j) == proto::kNoHeight, i == 10003 && j == 11997) << i << ", " << j;
  EXPECT_EQ(fine.at(10000, 12000), 10 * 1024);
}

TEST_F(Kernel, PixelIsPointIsTheHullOfValidPoints) {
  Spec spec = point_spec(5, 5000, 6000, 5, 4);
  spec.nodata = -9999;
  spec.value = [](int c, int r) { return c == 2 && r == 1 ? -9999.0 : 10.0; };
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  EXPECT_TRUE(std::isnan(height_m(*source, lattice(5), 5002, 5999)));
  EXPECT_EQ(height_m(*source, lattice(5), 5003, 5999), 10);
  EXPECT_TRUE(std::isnan(height_m(*source, lattice(6), 2 * 5002 + 1, 2 * 5999)));
  EXPECT_EQ(height_m(*source, lattice(6), 2 * 5003 + 1, 2 * 5999), 10);
}

TEST_F(Kernel, StillWaterIsMarked) {
  Spec spec = point_spec(5, 5000, 6000, 20, 12);
  spec.value = [](int c, int r) { return c < 10 ? 7.25 : bumpy(c, r); };
  const auto source = must_open(write(spec));
  const proto::Samples s = whole(*source, lattice(5));
  for (int c = 0; c < 20; ++c) {
    const std::size_t at = static_cast<std::size_t>(6) * s.columns + c;
    EXPECT_EQ(s.flat_water[at], c >= 1 && c <= 8 ? 1 : 0) << c;
  }
}

TEST_F(Kernel, TinyRasters) {
  for (const auto& [columns, rows] : {std::pair{1, 1}, {2, 1}, {1, 2}, {257, 257}}) {
    for (const bool point : {false, true}) {
      Spec spec;
      spec.columns = columns, spec.rows = rows, spec.point = point, spec.geotransform = cells_of(8, 70000, 50000);
      const auto source = must_open(write(spec));
      ASSERT_TRUE(source);
      const proto::Samples s = whole(*source, lattice(8));
      EXPECT_GE(s.columns, columns - 1);
      EXPECT_EQ(valid_share(s), 1.0) << columns << " x " << rows;
    }
  }
}

}  // namespace
}  // namespace cordillera::raster_test
