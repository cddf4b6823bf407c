#include "pipeline/plan/block_grid.h"

#include <algorithm>

#include "gpu/exact/simplify_block.h"
#include "pipeline/plan/plan.h"
#include "proto/integers.h"

namespace cordillera::pipeline {

using proto::floor_divide;

bool has_levels_above(const proto::Plan& plan) { return plan.block_level() > plan.min_level(); }

BlockGrid grid_of(const proto::Plan& plan) {
  const int z = static_cast<int>(plan.block_level());
  const std::int64_t units = block_side(plan);
  BlockGrid grid;
  grid.west = floor_divide(plan.window(0) - 1, units);
  grid.south = std::max<std::int64_t>(floor_divide(plan.window(1) - 1, units), 0);
  grid.across = static_cast<std::int32_t>(floor_divide(plan.window(2), units) - grid.west + 1);
  grid.up = static_cast<std::int32_t>(std::min<std::int64_t>(floor_divide(plan.window(3), units), proto::tiles_up(z) - 1) -
                                      grid.south + 1);
  // Where a tile of some level meets the window on two turns, it is all of the circle that is one piece.
  const int coarsest = static_cast<int>(plan.min_level());
  const std::int64_t side = lattice_of(plan).tile_units(coarsest), west = grid.west * units, east = west + grid.across * units;
  const std::int64_t touched = floor_divide(east - 1, side) - floor_divide(west, side) + 1;
  grid.closes = grid.across >= proto::tiles_across(z) || touched > proto::tiles_across(coarsest);
  if (grid.closes) grid.west = 0, grid.across = proto::tiles_across(z);
  return grid;
}

std::optional<std::int32_t> BlockGrid::number_at(std::int64_t column, std::int64_t row) const {
  if (closes) column = proto::modulo(column, across);
  if (column < 0 || row < 0 || column >= across || row >= up) return std::nullopt;
  return static_cast<std::int32_t>(row * across + column);
}

std::int64_t block_side(const proto::Plan& plan) { return lattice_of(plan).tile_units(static_cast<int>(plan.block_level())); }

proto::TileAddress node_at(const proto::Plan& plan, const BlockGrid& grid, std::int32_t k) {
  const int z = static_cast<int>(plan.block_level());
  const std::int64_t x = proto::modulo(grid.west + k % grid.across, proto::tiles_across(z));
  return {z, static_cast<std::int32_t>(x), static_cast<std::int32_t>(grid.south + k / grid.across)};
}

namespace {

/// Of the rectangle of all blocks.
struct Cells {
  std::int64_t across, up;
  bool closes;
};
Cells cells_of(const proto::Plan& plan) {
  const BlockGrid grid = grid_of(plan);
  const std::int64_t side = block_side(plan);
  return {grid.across * side, grid.up * side, grid.closes};
}

}  // namespace

bool has_one_ground(const proto::Plan& plan) {
  const Cells cells = cells_of(plan);
  return std::max(cells.across, cells.up) < gpu::exact::kMostAbove &&
         cells.across * cells.up <= (cells.closes ? kMostCellsAround : kMostCellsAbove);
}

proto::TileAddress node_above(const proto::Plan& plan) { return node_at(plan, grid_of(plan), 0).parent(); }

std::vector<proto::TileAddress> blocks_of(const proto::Plan& plan) {
  const BlockGrid grid = grid_of(plan);
  std::vector<proto::TileAddress> blocks;
  for (std::int32_t k = 0; k < grid.count(); ++k) blocks.push_back(node_at(plan, grid, k));
  return blocks;
}

}  // namespace cordillera::pipeline
