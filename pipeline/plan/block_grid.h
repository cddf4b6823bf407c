#pragma once
// Blocks of a plan side by side, and what is made above them.
#include <cstdint>
#include <optional>
#include <vector>

#include "cordillera.pb.h"
#include "proto/lattice.h"

namespace cordillera::pipeline {

/// Whether there are levels above the blocks of a plan.
bool has_levels_above(const proto::Plan& plan);

/// Whole nodes of the block level: those that the plan's window touches, none twice. Nodes between them may be outside of it.
struct BlockGrid {
  std::int64_t west = 0, south = 0;  ///< columns and rows of nodes; west may lie beyond the circle, where that is not closed
  std::int32_t across = 0, up = 0;
  bool closes = false;  ///< all around the earth, from the antimeridian on

  std::int32_t count() const { return across * up; }
  /// The number, as node_at has it, of the node so many columns and rows from the first one; none: there is none.
  std::optional<std::int32_t> number_at(std::int64_t column, std::int64_t row) const;
};
/// Samples from side to side of a node of the block level.
std::int64_t block_side(const proto::Plan& plan);
BlockGrid grid_of(const proto::Plan& plan);
/// Row by row from the south-west.
proto::TileAddress node_at(const proto::Plan& plan, const BlockGrid& grid, std::int32_t k);

/// One task makes all levels above the blocks. Whether these fit into one rectangle of gpu/exact, and take no more memory than
/// kMostCellsAbove stands for. Else levels above them are made region by region.
bool has_one_ground(const proto::Plan& plan);
/// Cells of the finest level of such a rectangle: 1.3 bytes of memory each, and of one that closes twice as many bytes. With all
/// else that a build has then, 2.1 and 2.9 GB were seen.
inline constexpr std::int64_t kMostCellsAbove = std::int64_t{1} << 30, kMostCellsAround = kMostCellsAbove / 2;
/// The node that stands for that task, of the level above the blocks.
proto::TileAddress node_above(const proto::Plan& plan);
/// What it is made of: all nodes of the grid, numbered as node_at has them.
std::vector<proto::TileAddress> blocks_of(const proto::Plan& plan);

}  // namespace cordillera::pipeline
