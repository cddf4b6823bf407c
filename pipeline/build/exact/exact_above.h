#pragma once
// Levels above exact blocks, all of them at once: from the blocks' meshes as one, against what is known of squares of their
// samples. So their errors are bounds, and no sample is read again.
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/exact/ground_meter.h"
#include "pipeline/build/exact/kept_block.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// The rectangle of all blocks.
BlockPlace place_above(const proto::Plan& plan);
/// Its ground and mesh. kept: indexed as node_at; null where a block has no data.
struct Above {
  gpu::exact::Ground ground;
  gpu::exact::BlockMesh start;
};
Above join_blocks(const proto::Plan& plan, const std::vector<const KeptBlock*>& kept);

/// Levels of the plan above its blocks.
gpu::exact::BlockPlan levels_above(const proto::Plan& plan);

/// States a tile's error: what the engine knows of it (max_error_m, as tiles_of_block has it), and what rounding may add. Steep
/// triangles and needles are measured as they will be decoded; where they are too far off, or upside down in space, vertices are
/// put back. Borrows what it is given.
class ErrorStatement {
 public:
  ErrorStatement(const LevelContext& context, const KnownGround& known, BuiltTile& tile);
  /// The steep triangles come in so many pieces, which may be measured by several threads: a tile of a town has few others.
  std::size_t pieces() const;
  void measure(std::size_t piece);
  /// After all pieces.
  void finish();

 private:
  const LevelContext& context_;
  BuiltTile& tile_;
  const GroundMeter known_;
  std::vector<std::uint32_t> steep_;
  std::vector<double> error_m_;  ///< indexed as steep_
};

}  // namespace cordillera::pipeline
