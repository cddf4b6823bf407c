// Line by line, and by rows of places, gives the bits that sample by sample gives.
#include "raster/sample/plate_lines.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

namespace cordillera::raster {
namespace {

constexpr int kColumns = 24, kRows = 20;

/// Pixels with a lake, a void and noise; two more than the raster on every side, as Kernel::around asks for.
PixelBlock block_of(bool with_voids) {
  PixelBlock block{{-2, -2, kColumns + 4, kRows + 4}, {}};
  std::mt19937 random(7);
  for (int y = -2; y < kRows + 2; ++y) {
    for (int x = -2; x < kColumns + 2; ++x) {
      const bool lake = x > 4 && x < 13 && y > 3 && y < 12, hole = with_voids && x > 15 && x < 18 && y > 5;
      const bool outside = x < 0 || y < 0 || x >= kColumns || y >= kRows;
      block.heights.push_back(outside || hole ? NAN : lake ? 0.1 : static_cast<double>(random() % 100000) / 333);
    }
  }
  return block;
}

/// Coinciding, half way, and anything between.
std::vector<double> places(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<double> at{NAN};
  for (int k = 0; k < 200; ++k) {
    const double whole = static_cast<double>(random() % static_cast<unsigned>(count)),
                 part = static_cast<double>(random() % 1000) / 1000;
    at.push_back(std::min(whole + (k % 4 == 0 ? 0 : k % 4 == 1 ? 0.5 : part), count - 1.0));
  }
  return at;
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

TEST(PlateLines, GivesTheBitsOfTheKernel) {
  for (const bool with_voids : {false, true}) {
    const PixelBlock block = block_of(with_voids);
    const Kernel kernel(KernelFrame{kColumns, kRows, 0, false, 1, 1});
    const std::vector<double> u = places(kColumns, 1), v = places(kRows, 2);
    PlateLines lines(block, u);
    std::vector<double> height(u.size());
    int compared = 0, flats = 0, voids = 0;
    for (const double at : v) {
      if (std::isnan(at)) continue;
      lines.heights(at, height.data());
      const std::uint8_t* const flat = lines.flat(at);
      EXPECT_TRUE(std::isnan(height[0]));
      for (std::size_t c = 1; c < u.size(); ++c) {
        const PixelPosition place{u[c], at};
        EXPECT_EQ(flat != nullptr && flat[c] != 0, kernel.flat(place, block));
        flats += kernel.flat(place, block);
        if (std::isnan(height[c])) {
          ++voids;  // the kernel may know more
          continue;
        }
        ++compared;
        ASSERT_TRUE(kernel.valid(place, block));
        ASSERT_TRUE(same_bits(height[c], kernel.value(place, block))) << u[c] << ", " << at;
      }
    }
    EXPECT_GT(compared, 20000);
    EXPECT_GT(flats, 1000);
    EXPECT_EQ(voids > 5000, with_voids);  // the last column and row have void pixels beside them
  }
}

TEST(KernelRows, GiveTheBitsOfEachPlace) {
  const PixelBlock block = block_of(true);
  for (const int period : {0, kColumns}) {
    const Kernel kernel(KernelFrame{kColumns, kRows, period, false, 1, 1});
    std::vector<double> x, y;
    std::mt19937 random(3);
    for (int k = 0; k < 5000; ++k) {  // some outside, some within a millionth of a centre or an edge
      const double near = k % 5 == 0 ? 4e-7 : 0;
      x.push_back(k % 50 == 0 ? NAN : static_cast<double>(random() % 520) / 20 - 1 + near);
      y.push_back(static_cast<double>(random() % 440) / 20 - 1 - near);
    }
    std::vector<double> u = x, v = y, height(x.size());
    std::vector<std::uint8_t> level(x.size());
    kernel.locate(u.data(), v.data(), u.size());
    for (std::size_t k = 0; k < u.size(); ++k) {
      const double alone_u = kernel.locate_u(x[k]), alone_v = kernel.locate_v(y[k]);
      const bool outside = std::isnan(alone_u) || std::isnan(alone_v);
      ASSERT_EQ(std::isnan(u[k]), outside) << x[k] << ", " << y[k];
      ASSERT_EQ(std::isnan(v[k]), outside);
      ASSERT_TRUE(outside || (u[k] == alone_u && v[k] == alone_v)) << x[k] << ", " << y[k];
    }
    kernel.heights(u.data(), v.data(), u.size(), block, height.data(), level.data());
    int compared = 0, flats = 0;
    for (std::size_t k = 0; k < u.size(); ++k) {
      if (std::isnan(u[k])) continue;
      const PixelPosition place{u[k], v[k]};
      const bool flat = kernel.flat(place, block);
      flats += flat ? 1 : 0;
      ASSERT_TRUE(!flat || level[k] != 0) << u[k] << ", " << v[k];
      if (std::isnan(height[k])) continue;
      ++compared;
      ASSERT_TRUE(kernel.valid(place, block));
      ASSERT_TRUE(same_bits(height[k], kernel.value(place, block))) << u[k] << ", " << v[k];
    }
    EXPECT_GT(compared, 2000);
    EXPECT_GT(flats, 100);
  }
}

}  // namespace
}  // namespace cordillera::raster
