#pragma once
// The fill of earlier versions, to be compared with.
#include <vector>

namespace cordillera::bench {

/// Replaces NaN by the mean of the first number in each of the eight directions, no farther than 100 cells, weighted by 1 /
/// distance^2. columns*rows values, row-major.
void fill_from_eight_directions(std::vector<double>& values, int columns, int rows);

}  // namespace cordillera::bench
