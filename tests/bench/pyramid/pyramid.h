#pragma once
// A whole pyramid of one kind of terrain through a simplifier, without GDAL, protobuf or Draco: grids, chains, waves, welds.
#include <cstdint>
#include <string>
#include <vector>

#include "gpu/simplify.h"
#include "tests/bench/pyramid/terrain.h"

namespace cordillera::bench {

struct LevelFigures {
  int level = 0;
  std::size_t tiles = 0, vertices_in = 0, vertices = 0, triangles = 0;
  double prepare_s = 0, simplify_s = 0;
  std::vector<gpu::StageTime> stages;  ///< of simplify_s
  std::uint64_t hash = 0;  ///< FNV-1a over tiles, positions, heights, marks and triangles, in order
};

/// across x across finest tiles (a power of two) around 46 N 7 E, tolerance_m at the finest level doubling upwards, down to one tile.
/// Every level is simplified `repeats` times and the fastest counts.
std::vector<LevelFigures> run_pyramid(Terrain kind, int across, float tolerance_m, gpu::Simplifier& simplifier, int repeats = 1);

}  // namespace cordillera::bench
