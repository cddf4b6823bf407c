#pragma once
// A triangle held against samples, square by square, by one thread: large squares first, their parts where those do not decide.
#include "gpu/exact/steps/triangle.h"

namespace cordillera::gpu::exact {

/// All samples of a square of 8.
CORDILLERA_HD inline bool samples_fit(const Triangle& t, const Field& field, int sx, int sy) {
  const int east = least(8 * sx + 7, t.east), north = least(8 * sy + 7, t.north);
  for (int y = greatest(8 * sy, t.south); y <= north; ++y) {
    for (int x = greatest(8 * sx, t.west); x <= east; ++x) {
      if (!sample_fits(t, field, x, y)) return false;
    }
  }
  return true;
}

/// The squares of a range, tier by tier. Samples: how the last squares are looked at.
template <class Samples>
CORDILLERA_HD bool squares_fit(const Triangle& t, const Field& field, int tier, const SquareRange& range,
                               const Samples& samples) {
  for (int y = range.south; y <= range.north; ++y) {
    for (int x = range.west; x <= range.east; ++x) {
      if (square_fits(t, field, tier, x, y)) continue;
      if (tier == 0) {
        if (!samples(t, field, x, y)) return false;
      } else if (!squares_fit(t, field, tier - 1, parts_under(t, tier, x, y), samples)) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace cordillera::gpu::exact
