#pragma once
// Levels above exact blocks, all of them at once: from the blocks' meshes as one, against what is known of squares of their
// samples. No sample is read again. error_statement.h has their errors.
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/exact/joined_mesh.h"
#include "pipeline/plan/block_grid.h"

namespace cordillera::pipeline {

/// The rectangle of all blocks.
BlockPlace place_above(const proto::Plan& plan);
/// Its ground and mesh.
struct Above {
  gpu::exact::Ground ground;
  gpu::exact::BlockMesh start;
};
/// A rectangle of which nothing is known yet; without a curve. Its memory takes as long to be had as blocks to be read. What
/// `ground` has is used again.
void make_unknown(const proto::Plan& plan, const BlockPlace& place, gpu::exact::Ground& ground);
/// The ground of all blocks; all around the earth, where they are.
gpu::exact::Ground unknown_ground(const proto::Plan& plan);
/// Puts the squares of a block into it, whose first sample is the ground's (x, y); those of other blocks may be put meanwhile.
void place_squares(std::int64_t block_side, std::int64_t x, std::int64_t y, const gpu::exact::Squares& squares,
                   gpu::exact::Ground& ground);

/// A ground that closes, and a mesh of it, cut half of the circle farther on.
gpu::exact::Ground half_turned(const gpu::exact::Ground& ground);
gpu::exact::BlockMesh half_turned(const gpu::exact::BlockMesh& mesh, std::int32_t columns);

/// Levels of the plan above its blocks.
gpu::exact::BlockPlan levels_above(const proto::Plan& plan);
/// The same of all data: rims move less where otherwise less than half of it would be left.
gpu::exact::BlockPlan levels_above(const proto::Plan& plan, const gpu::exact::Ground& all);
/// What codes leave open for them, where they could tell more: see Ground. A 512th of the first one's target, which no height of
/// the rasters changes: a block that stays as it is can be built on.
float code_unit(const proto::Plan& plan);

}  // namespace cordillera::pipeline
