#pragma once
// From samples or four children to a tile's finished mesh: the pure function at the heart of a dataset.
//
//   finest level:   mesh = simplify( grid(samples),  border chains, target )
//   coarser levels: mesh = simplify( weld(children), border chains, target )
//
// So it is with waves and other strategies that simplify tile by tile, and in merges above. The default, exact, simplifies a
// block at once (build/exact/exact_block.h) and shares the structs, the measuring and what puts vertices back (tile_error.h).
#include <array>
#include <optional>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/measure/surface_error.h"
#include "gpu/simplify.h"
#include "pipeline/bound/surface.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Whether one of the tile's sides is a pole.
inline bool is_at_pole(const proto::TileAddress& tile) { return tile.y == 0 || tile.y + 1 == proto::tiles_up(tile.z); }

class SampleCounts;

/// A finished mesh of a tile. Covers the whole rectangle; may be void throughout.
struct BuiltTile {
  proto::TileAddress tile;
  proto::TileMesh mesh;
  double max_error_m = 0;  ///< stated
  bool composed = false;   ///< bound by composition instead of measured against finest samples
  gpu::SurfaceError measured;
  std::uint32_t put_back = 0;      ///< vertices, for the promise
  std::size_t bare = 0;            ///< samples well inside the data that nothing covers, see uncovered_inside
  std::size_t turned = 0;          ///< triangles that are upside down in space
  Loose loose{};                   ///< what the mesh leaves uncovered, where a tile above the blocks will be measured against it
  std::optional<Surface> finer{};  ///< its children's, likewise
};

/// A limit that is less than so many times what rounding may make of an error is none: edges would be turned for that alone.
inline constexpr double kNearRounding = 1.35;

/// What every tile of a level shares.
struct LevelContext {
  const proto::Lattice* lattice = nullptr;
  const proto::LevelPlan* level = nullptr;
  bool promise = false;                     ///< stated errors may not exceed level->target()
  const proto::Samples* samples = nullptr;  ///< finest samples of the block; nullptr above the blocks
  bool measured = true;                     ///< false: the mesh alone is wanted, and no error of it
  bool merges_above = false;                ///< the tile is a block or above: keep what its parent will be measured against
  bool sparse_start = true;                 ///< a promised tile may start without what it would hardly keep
  int height_rounds = 0;                    ///< see gpu::Thinning; below 0: nothing is thinned
  std::int64_t rim_reach = 0;  ///< units that samples reach beyond the block, see pipeline::rim_reach; 0: that of the level
  double least_limit = kNearRounding;         ///< the limit in place of one nearer to rounding, see limit_of
  const gpu::SampleFrames* frames = nullptr;  ///< of samples, where more than one tile will be measured
  const SampleCounts* counts = nullptr;       ///< of samples, where tiles will be encoded
};

/// A tile ready to be simplified: input mesh with border chains applied. nullopt: no valid sample, nothing to do.
struct PreparedTile {
  proto::TileAddress tile;
  proto::TileMesh input;
  std::vector<float> elevation;
  double inherited_error_m = 0;            ///< greatest stated error of the children; 0 at the finest level
  std::uint32_t inherited_uncovered = 0;   ///< of the children together
  Loose inherited_loose{};                 ///< likewise, above the blocks
  std::vector<std::uint32_t> over_void{};  ///< likewise: vertices of input that are kOverVoid in a child
  std::optional<Surface>
      truth{};           ///< above the blocks: the surface that stands for the samples, two levels finer where there is one
  double caution = 1;    ///< tolerances are divided by it
  double rim_share = 1;  ///< the level's rim tolerance is multiplied by it
  float start_tolerance_m = 0;      ///< > 0: the simplifier starts without the samples that a promise will hardly need
  std::optional<BuiltTile> best{};  ///< of the attempts so far, where none kept the promise

  gpu::SimplifyJob job(const LevelContext& context) const;
};
std::optional<PreparedTile> prepare_finest(const LevelContext& context, const proto::TileAddress& tile);
/// children: index bit 0 east, bit 1 north; nullptr where a child has no data.
std::optional<PreparedTile> prepare_parent(const LevelContext& context, const proto::TileAddress& tile,
                                           const std::array<const BuiltTile*, 4>& children);

/// Is the border of a simplification's result what its chain wants? If not, more is marked kKeep in prepared: simplify again.
bool has_its_border(const LevelContext& context, PreparedTile& prepared, const proto::TileMesh& mesh, int attempt);

/// Measures the result of prepared's simplification and, where the promise is broken, puts vertices back. Nullopt when the border
/// is not as its chain wants it or the promise is broken still: more is marked kKeep in prepared, simplify again.
std::optional<BuiltTile> finish(const LevelContext& context, PreparedTile& prepared, proto::TileMesh mesh, int attempt);

/// All of it for one tile: prepared -> simplified (and again, while finish asks for it) -> finished.
BuiltTile complete(const LevelContext& context, PreparedTile& prepared, gpu::Simplifier& simplifier);

}  // namespace cordillera::pipeline
