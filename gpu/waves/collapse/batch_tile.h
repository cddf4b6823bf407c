#pragma once
// The tiles of a batch, one after the other.
#include <cstddef>

#include "gpu/waves/collapse/wave_loop.h"

namespace cordillera::gpu {

struct BatchTile {
  std::uint32_t first = 0;  ///< its first vertex
  std::int32_t side = 0;
  std::int32_t cells = 0;       ///< > 0: a regular grid, its rings and positions are arithmetic
  float start_tolerance_m = 0;  ///< > 0: of that grid only what the sparse start leaves
  bool any_void = false;        ///< known where there is a sparse start
  Rules rules;
};

struct TileFinder {
  const BatchTile* tiles = nullptr;
  std::size_t count = 0;

  CORDILLERA_HD std::uint32_t of(std::uint32_t vertex) const {
    std::size_t low = 0, high = count;
    while (high - low > 1) {
      const std::size_t middle = (low + high) / 2;
      (tiles[middle].first <= vertex ? low : high) = middle;
    }
    return static_cast<std::uint32_t>(low);
  }
};

}  // namespace cordillera::gpu
