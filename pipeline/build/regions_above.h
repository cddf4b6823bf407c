#pragma once
// Levels above exact blocks where these are more than one ground may hold: level by level, and each level region by region.
//
// A region is a ground of up to 2 x 2 quarters. Vertices on its sides keep their places, as beyond them lies another region. On
// the next level regions begin one quarter farther on, both ways: what was a side is inside of one then. So a side has, for one
// level, the vertices of the level below, and regions need not know each other. Where tiles are larger than quarters, sides of
// quarters are lines all the same, and a tile is put together from several regions. A quarter without data is void triangles that
// fit its neighbours; a region of such ones is not made. Memory is that of the regions that are
// made at once, some 0.6 GB each, and of the finer level's mesh.
#include <atomic>
#include <cstdint>
#include <functional>

#include "pipeline/build/exact/exact_simplifiers.h"
#include "pipeline/build/exact/gathered_blocks.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"

namespace cordillera::pipeline {

/// Samples from side to side of a quarter. Quarters lie at lattice multiples of it. A region's ground takes 0.35 GB.
inline constexpr std::int32_t kQuarterSide = 1 << 13;

struct RegionsTeam {
  ExactSimplifiers& simplifiers;
  Workers& workers;
  const std::atomic<bool>& stop;
  const std::function<void(double)>& share;  ///< how much is done, 0 to 1; called by one thread
  std::size_t at_once = 1;                   ///< regions, side by side
};

/// All tiles above the blocks. quarter_side: a power of two, no less than a block's side, and at most half of the circle.
/// Problems: those of mesh_of, of kept_block_from() and of the simplifiers; kCancelled.
proto::Result<FinishedTask> build_regions_above(const proto::Plan& plan, const GatheredBlocks::MeshOf& mesh_of,
                                                const RegionsTeam& team, std::int32_t quarter_side = kQuarterSide);

}  // namespace cordillera::pipeline
