// Many samples at once give the numbers that each gives alone.
#include "gpu/measure/surface_error_row.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::gpu {
namespace {

struct Row {
  std::vector<double> sin_lon, cos_lon;
  std::vector<std::int32_t> height;
  RowRun run(std::size_t from, std::size_t count) const {
    return {sin_lon.data() + from, cos_lon.data() + from, height.data() + from, count};
  }
};

Row row_of(std::size_t count, std::mt19937& random) {
  Row row;
  for (std::size_t k = 0; k < count; ++k) {
    const double lon = 0.1 + 3e-6 * static_cast<double>(k);
    row.sin_lon.push_back(std::sin(lon));
    row.cos_lon.push_back(std::cos(lon));
    row.height.push_back(random() % 9 == 0 ? proto::kNoHeight : static_cast<std::int32_t>(random() % 4'000'000) - 1'000'000);
  }
  return row;
}

TEST(SurfaceErrorRow, ErrorsAreThoseOfEachSample) {
  std::mt19937 random(3);
  const Row row = row_of(300, random);
  const proto::Lattice lattice{12};
  const std::int64_t south = lattice.rows() * 3 / 4;
  const auto corner = [&](std::int64_t x, std::int64_t y, double h) {
    return proto::ecef(proto::row_frame(lattice, south + y), proto::column_frame(lattice, lattice.columns() / 2 + x), h);
  };
  const auto at = [&](double h) { return plane_of(corner(0, 0, h), corner(400, 0, 300 - h), corner(0, 400, 2 * h)); };
  for (const Plane& plane : {at(100), at(-50), Plane{{0, 0, 0}, 0}}) {  // the last: no number anywhere
    const PlaneRow along(plane, proto::row_frame(lattice, south + 17));
    for (const HeightRange& range : {HeightRange{-200, 400}, HeightRange{80, 90}}) {
      for (const std::size_t count : {0u, 1u, 3u, 4u, 7u, 64u, 255u, 256u}) {
        const std::size_t from = count % 5;
        std::vector<double> out(count + 1, -7);
        const double greatest = row_errors(along, range, row.run(from, count), out.data());
        double most = 0;
        for (std::size_t k = 0; k < count; ++k) {
          const std::int32_t h = row.height[from + k];
          const double error =
              std::abs(range.clamp(along.height_m(row.sin_lon[from + k], row.cos_lon[from + k])) - h * proto::kHeightStep_m);
          ASSERT_EQ(out[k], h == proto::kNoHeight ? 0 : error) << k << " of " << count;
          most = std::max(most, out[k]);
        }
        EXPECT_EQ(greatest, most);
        EXPECT_EQ(greatest_row_error(along, range, row.run(from, count)), most);
        EXPECT_EQ(out[count], -7);
      }
    }
  }
}

TEST(SurfaceErrorRow, SeesLowestAndHighest) {
  std::mt19937 random(7);
  const Row row = row_of(300, random);
  for (const std::size_t count : {0u, 1u, 5u, 16u, 299u}) {
    RowHeights seen, expected;
    see_heights(row.height.data(), count, seen);
    for (std::size_t k = 0; k < count; ++k) {
      const std::int32_t h = row.height[k];
      if (h == proto::kNoHeight) continue;
      ++expected.valid;
      expected.lowest = std::min(expected.lowest, h);
      expected.highest = std::max(expected.highest, h);
    }
    EXPECT_EQ(seen.valid, expected.valid);
    EXPECT_EQ(seen.lowest, expected.lowest);
    EXPECT_EQ(seen.highest, expected.highest);
  }
}

TEST(SurfaceErrorRow, SquaresAddUpExactly) {
  std::mt19937 random(5);
  // Small ones, ones whose squares end in a half, ones beyond what a double adds exactly, and beyond what counts.
  for (const double scale : {1e-4, 0.02, 3.0, 700.0, 2040.0, 5000.0, 3e7}) {
    for (const std::size_t count : {0u, 1u, 4u, 9u, 256u}) {
      std::vector<double> errors;
      for (std::size_t k = 0; k < count; ++k) {
        errors.push_back(k % 7 == 0 ? std::sqrt((static_cast<double>(k) + 0.5) / kSquaresPerStep)
                                    : scale * static_cast<double>(random() % 100000) / 100000);
      }
      SquareSum fast, slow;
      add_squares(errors.data(), count, fast);
      for (const double e : errors) slow.add(square_steps(e));
      EXPECT_EQ(fast.high + (fast.low >> 32), slow.high + (slow.low >> 32)) << scale;
      EXPECT_EQ(fast.low & 0xffffffffu, slow.low & 0xffffffffu) << scale;
      EXPECT_EQ(fast.value_m2(), slow.value_m2());
    }
  }
}

}  // namespace
}  // namespace cordillera::gpu
