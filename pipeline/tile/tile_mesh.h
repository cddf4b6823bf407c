#pragma once
// A finished mesh of a tile, and what is asked of it.
#include <cstddef>
#include <cstdint>

#include "cordillera.pb.h"
#include "gpu/measure/surface_error.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Whether one of the tile's sides is a pole.
inline bool is_at_pole(const proto::TileAddress& tile) { return tile.y == 0 || tile.y + 1 == proto::tiles_up(tile.z); }

class SampleCounts;

/// A finished mesh of a tile: of the whole rectangle that holds its data, or of published triangles alone.
struct BuiltTile {
  proto::TileAddress tile;
  proto::TileMesh mesh;
  double max_error_m = 0;  ///< stated
  bool composed = false;   ///< a bound above the blocks, instead of measured against finest samples
  gpu::SurfaceError measured;
  std::uint32_t put_back = 0;  ///< vertices, for the promise
};

/// What every tile of a level shares.
struct LevelContext {
  const proto::Lattice* lattice = nullptr;
  const proto::LevelPlan* level = nullptr;
  const proto::Samples* samples = nullptr;    ///< finest samples of the block; nullptr above the blocks
  bool put_back = true;                       ///< vertices, where the target is exceeded
  const gpu::SampleFrames* frames = nullptr;  ///< of samples, where more than one tile will be measured
  const SampleCounts* counts = nullptr;       ///< of samples, where tiles will be encoded
};

}  // namespace cordillera::pipeline
