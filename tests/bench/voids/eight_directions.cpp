#include "tests/bench/voids/eight_directions.h"

#include <cmath>

namespace cordillera::bench {
namespace {

constexpr int kReach = 100;

}  // namespace

void fill_from_eight_directions(std::vector<double>& values, int columns, int rows) {
  const std::vector<double> given = values;
  const auto inside = [&](int x, int y) { return x >= 0 && y >= 0 && x < columns && y < rows; };
  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
  };
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (!std::isnan(given[at(x, y)])) continue;
      double sum = 0, weights = 0;
      for (int d = 0; d < 9; ++d) {
        const int dx = d % 3 - 1, dy = d / 3 - 1;
        int steps = 1;
        if (dx == 0 && dy == 0) continue;
        while (steps <= kReach && inside(x + steps * dx, y + steps * dy) && std::isnan(given[at(x + steps * dx, y + steps * dy)]))
          ++steps;
        if (steps > kReach || !inside(x + steps * dx, y + steps * dy)) continue;
        const double weight = 1.0 / ((dx * dx + dy * dy) * steps * steps);
        sum += weight * given[at(x + steps * dx, y + steps * dy)];
        weights += weight;
      }
      if (weights > 0) values[at(x, y)] = sum / weights;
    }
  }
}

}  // namespace cordillera::bench
