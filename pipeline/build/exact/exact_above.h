#pragma once
// Levels above exact blocks, all of them at once: from the blocks' meshes as one, against what is known of squares of their
// samples. No sample is read again. error_statement.h has their errors.
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/plan/block_grid.h"

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

}  // namespace cordillera::pipeline
