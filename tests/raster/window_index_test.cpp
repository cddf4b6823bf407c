// The index of windows says what trying each with each says.
#include "raster/mosaic/window_index.h"

#include <gtest/gtest.h>

#include <random>

#include "raster/mosaic/mosaic.h"

namespace cordillera::raster_test {
namespace {

using raster::Source;

std::vector<std::uint32_t> tried_one_by_one(const std::vector<Source::Window>& windows, const Source::Window& asked,
                                            const proto::Lattice& lattice) {
  std::vector<std::uint32_t> found;
  for (std::size_t k = 0; k < windows.size(); ++k) {
    if (raster::touch(windows[k], asked, lattice)) found.push_back(static_cast<std::uint32_t>(k));
  }
  return found;
}

/// Small and large ones, some around the circle's end, some around all of it, some empty.
std::vector<Source::Window> scattered(const proto::Lattice& lattice, int count) {
  std::mt19937 random(7);
  const auto below = [&](std::int64_t n) { return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n)); };
  std::vector<Source::Window> windows;
  for (int k = 0; k < count; ++k) {
    const std::int64_t side = k % 10 == 0  ? lattice.columns()
                              : k % 3 == 0 ? lattice.rows() / 4
                                           : std::max<std::int64_t>(1, lattice.rows() / 180);
    const std::int64_t west = below(2 * lattice.columns()) - lattice.columns() / 2, south = below(lattice.rows() + 1);
    windows.push_back({west, south, west + below(side + 1), std::min(lattice.rows(), south + below(side + 1))});
    if (k % 17 == 0) windows.push_back({0, 0, -1, -1});
  }
  return windows;
}

TEST(WindowIndex, finds_what_trying_each_finds) {
  for (const int level : {0, 5, 12}) {
    const proto::Lattice lattice{level};
    const auto windows = scattered(lattice, 400);
    const raster::WindowIndex index(windows, lattice);
    for (Source::Window asked : scattered(lattice, 150)) {
      ASSERT_EQ(index.touching(asked), tried_one_by_one(windows, asked, lattice)) << level;
      asked.south -= 40;  // as a block asks that looks beyond the pole
      asked.north += 40;
      ASSERT_EQ(index.touching(asked), tried_one_by_one(windows, asked, lattice)) << level;
    }
  }
}

TEST(WindowIndex, of_the_pole_and_of_the_antimeridian) {
  const proto::Lattice lattice{4};
  const std::int64_t columns = lattice.columns(), rows = lattice.rows();
  const raster::WindowIndex index({{0, rows, columns, rows}, {columns - 3, 10, columns, 12}, {40, 10, 50, 12}}, lattice);
  EXPECT_EQ(index.touching({7, rows, 7, rows}), std::vector<std::uint32_t>{0});
  EXPECT_EQ(index.touching({0, 12, 5, 30}), std::vector<std::uint32_t>{1});
  EXPECT_TRUE(index.touching({1, 12, 5, 30}).empty());
}

}  // namespace
}  // namespace cordillera::raster_test
