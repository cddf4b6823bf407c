#pragma once
// A whole pyramid of one kind of terrain through a simplifier, without GDAL, protobuf or Draco: grids, chains, waves, welds.
#include <cstdint>
#include <vector>

#include "gpu/measure/batch_meter.h"
#include "gpu/simplify.h"
#include "tests/bench/pyramid/terrain.h"

namespace cordillera::bench {

struct LevelFigures {
  int level = 0;
  std::size_t tiles = 0, vertices_in = 0, vertices = 0, triangles = 0;
  double prepare_s = 0, simplify_s = 0;
  std::vector<proto::StageTime> stages;  ///< of simplify_s
  double measure_s = 0;                  ///< true errors of all its tiles; 0: not asked for
  double max_error_m = 0, rmse_m = 0;
  std::uint64_t hash = 0;  ///< FNV-1a over tiles, positions, heights, marks and triangles, in order
};

struct PyramidRun {
  int repeats = 1;     ///< every level is simplified so often and the fastest counts
  bool alone = false;  ///< every tile in a call of its own; `stages` is of the last
  int levels = 99;     ///< at most, from the finest
  float start_share =
      0;  ///< of the tolerance, for what the finest level's sparse start may leave out; 0: it starts from all samples
  bool errors = false;                                   ///< every level is measured against all finest samples, as often
  gpu::BatchMeter* meter = nullptr;                      ///< a GPU that helps with it
  gpu::ParallelFor parallel = gpu::one_after_the_other;  ///< of what the host measures
};

/// across x across finest tiles (a power of two) around 46 N 7 E, tolerance_m at the finest level doubling upwards, down to one
/// tile.
std::vector<LevelFigures> run_pyramid(Terrain kind, int across, float tolerance_m, gpu::Simplifier& simplifier,
                                      const PyramidRun& run = {});

}  // namespace cordillera::bench
