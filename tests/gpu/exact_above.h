#pragma once
// Levels of one block of which the last are made above it, from what it hands out.
#include "gpu/exact/simplify_block.h"

namespace cordillera::gpu::exact {

/// plan's levels: those from `below` on come from simplify_above.
inline proto::Result<std::vector<BlockMesh>> simplified_above(BlockSimplifier& simplifier, const Block& block,
                                                              const BlockPlan& plan, std::size_t below) {
  BlockPlan in_block = plan, above = plan;
  in_block.levels.resize(below);
  in_block.known_reach = plan.levels.back().rim_reach;
  above.levels.erase(above.levels.begin(), above.levels.begin() + static_cast<std::ptrdiff_t>(below));
  above.tile_side <<= below;
  Ground ground;
  ground.west = block.west, ground.south = block.south;
  ground.columns = block.columns, ground.rows = block.rows;
  ground.curve = block.curve, ground.curve_up = block.curve_up;
  ground.sample_m = block.sample_m;
  Watch watch;
  watch.squares = [&](std::size_t, Squares&& squares) { ground.squares = std::move(squares); };
  auto finer = simplifier.simplify({&block, 1}, in_block, watch);
  if (!finer.ok()) return finer.problem();
  std::vector<BlockMesh> levels = std::move(finer->front());
  auto coarser = simplifier.simplify_above(std::move(ground), levels.back(), above);
  if (!coarser.ok()) return coarser.problem();
  for (BlockMesh& mesh : *coarser) levels.push_back(std::move(mesh));
  return levels;
}

}  // namespace cordillera::gpu::exact
