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
/// Its ground and mesh.
struct Above {
  gpu::exact::Ground ground;
  gpu::exact::BlockMesh start;
};
/// The ground of all blocks, of which nothing is known yet. Its memory takes as long to be had as blocks to be read.
gpu::exact::Ground unknown_ground(const proto::Plan& plan);
/// Puts the squares of the block node_at(k) into it; those of other blocks may be put meanwhile.
void place_squares(const proto::Plan& plan, std::int32_t k, const gpu::exact::Squares& squares, gpu::exact::Ground& ground);
/// All blocks' meshes as one. Indexed as node_at; null where a block has no data.
gpu::exact::BlockMesh joined_mesh(const proto::Plan& plan, const std::vector<const proto::TileMesh*>& meshes);

/// A ground that closes, and a mesh of it, cut half of the circle farther on.
gpu::exact::Ground half_turned(const gpu::exact::Ground& ground);
gpu::exact::BlockMesh half_turned(const gpu::exact::BlockMesh& mesh, std::int32_t columns);

/// Levels of the plan above its blocks.
gpu::exact::BlockPlan levels_above(const proto::Plan& plan);

/// States a tile's error: what the engine knows of it (max_error_m, as tiles_of_block has it), and what rounding may add. Steep
/// triangles and needles are measured as they will be decoded; where they are too far off, or upside down in space, vertices are
/// put back. Borrows what it is given. A coarse tile has few others beside it, so its own pieces go to several threads.
class ErrorStatement {
 public:
  ErrorStatement(const LevelContext& context, const KnownGround& known, BuiltTile& tile);
  std::size_t pieces() const;  ///< of steep triangles
  void measure(std::size_t piece);
  void put_back();            ///< after all pieces
  std::size_t bands() const;  ///< of the samples that the RMSE looks at, after put_back()
  void measure_band(std::size_t band);
  void finish();  ///< after all bands

 private:
  const LevelContext& context_;
  BuiltTile& tile_;
  const GroundMeter known_;
  std::vector<std::uint32_t> steep_;
  std::vector<double> error_m_;           ///< indexed as steep_
  int step_ = 0;                          ///< between samples that the RMSE looks at
  std::vector<gpu::SurfaceError> bands_;  ///< sums of squares
};

}  // namespace cordillera::pipeline
