#include "raster/fill.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace cordillera::raster {
namespace {

constexpr std::uint8_t kNone = 255;
static_assert(kFillReach_px < kNone);

struct Direction {
  int dx, dy;
};
constexpr std::array<Direction, 8> kDirections{{{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};

/// Steps from each pixel to the first valid one in direction d; kNone beyond reach. One pass: a void is one step farther than the
/// pixel before it.
std::vector<std::uint8_t> steps_to_valid(const std::vector<double>& values, int columns, int rows, Direction d) {
  std::vector<std::uint8_t> steps(values.size(), kNone);
  for (int n = 0; n < rows; ++n) {
    const int y = d.dy > 0 ? rows - 1 - n : n;
    for (int m = 0; m < columns; ++m) {
      const int x = d.dx > 0 ? columns - 1 - m : m;
      const std::size_t at = static_cast<std::size_t>(y) * columns + x;
      if (!std::isnan(values[at])) {
        steps[at] = 0;
        continue;
      }
      const int nx = x + d.dx, ny = y + d.dy;
      if (nx < 0 || nx >= columns || ny < 0 || ny >= rows) continue;
      const std::uint8_t next = steps[static_cast<std::size_t>(ny) * columns + nx];
      if (next < kFillReach_px) steps[at] = static_cast<std::uint8_t>(next + 1);
    }
  }
  return steps;
}

}  // namespace

void fill_voids(std::vector<double>& values, int columns, int rows) {
  if (std::none_of(values.begin(), values.end(), [](double v) { return std::isnan(v); })) return;
  std::vector<double> sum(values.size(), 0), weights(values.size(), 0);
  for (const Direction d : kDirections) {
    const std::vector<std::uint8_t> steps = steps_to_valid(values, columns, rows, d);
    const double step2 = d.dx * d.dx + d.dy * d.dy;
    const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(d.dy) * columns + d.dx;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (steps[i] == 0 || steps[i] == kNone) continue;
      const double weight = 1.0 / (step2 * steps[i] * steps[i]);
      sum[i] += weight * values[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + stride * steps[i])];
      weights[i] += weight;
    }
  }
  for (std::size_t i = 0; i < values.size(); ++i)
    if (weights[i] > 0) values[i] = sum[i] / weights[i];
}

}  // namespace cordillera::raster
