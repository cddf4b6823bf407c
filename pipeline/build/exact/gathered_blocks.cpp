#include "pipeline/build/exact/gathered_blocks.h"

#include <algorithm>
#include <utility>

#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

GatheredBlocks::GatheredBlocks(const proto::Plan& plan, Workers& workers, const std::atomic<bool>& stop)
    : plan_(plan), workers_(workers), stop_(stop), code_unit_(code_unit(plan)), nodes_(blocks_of(plan)), blocks_(nodes_.size()) {}

double GatheredBlocks::bytes() const {
  constexpr double kBytesOfCell = 1.3;
  const double side = static_cast<double>(block_side(plan_));
  return kBytesOfCell * side * side * static_cast<double>(count());
}

void GatheredBlocks::begin() {
  ground_there_ = std::async(std::launch::async | std::launch::deferred, [this] { make_ground(); }).share();
}

void GatheredBlocks::make_ground() { ground_ = unknown_ground(plan_); }

void GatheredBlocks::take(const FinishedTask& block) {
  const auto node = std::find(nodes_.begin(), nodes_.end(), block.node);
  if (!block.mesh || node == nodes_.end()) return;
  auto kept = kept_block_from(block.mesh->second, lattice_of(plan_).tile_units(block.node.z), code_unit_);
  if (!kept.ok()) return;  // whoever reads it from the store says so
  std::shared_future<void>(ground_there_).wait();
  place(static_cast<std::size_t>(node - nodes_.begin()), std::move(*kept));
}

void GatheredBlocks::place(std::size_t k, KeptBlock&& block) {
  if (!block.squares.depth.empty()) voids_ = true;
  const BlockGrid grid = grid_of(plan_);
  const auto column = static_cast<std::int64_t>(k) % grid.across, row = static_cast<std::int64_t>(k) / grid.across;
  const std::int64_t side = block_side(plan_);
  place_squares(side, column * side, row * side, block.squares, ground_);
  block.squares = {};
  blocks_[k] = std::move(block);
}

proto::Result<std::optional<Above>> GatheredBlocks::all(const MeshOf& mesh_of) {
  const std::int64_t side = block_side(plan_);
  const auto read = [&](std::size_t k) {
    const auto bytes = mesh_of(nodes_[k]);
    if (!bytes.ok())
      blocks_[k] = bytes.problem();
    else if (*bytes)
      blocks_[k] = kept_block_from(**bytes, side, code_unit_);
  };
  std::vector<std::size_t> left;
  for (std::size_t k = 0; k < count(); ++k) {
    if (!blocks_[k]) left.push_back(k);
  }
  // Some blocks are read while the ground's memory is had. Of the others each is put there as it is read, so that not all of them
  // are in memory twice.
  constexpr std::size_t kReadMeanwhile = 64;
  const std::size_t meanwhile = std::min(left.size(), kReadMeanwhile);
  workers_.each(1 + meanwhile, [&](std::size_t n, unsigned) {
    if (n > 0)
      read(left[n - 1]);
    else if (ground_there_.valid())
      ground_there_.wait();
    else
      make_ground();
  });
  workers_.each(left.size(), [&](std::size_t n, unsigned) {
    const std::size_t k = left[n];
    if (n >= meanwhile && !stop_) read(k);
    if (blocks_[k] && blocks_[k]->ok())
      place(k, std::move(**blocks_[k]));
    else
      voids_ = true;
  });
  if (stop_) return std::optional<Above>();
  if (!voids_) ground_.squares.depth.clear();
  for (const auto& block : blocks_) {
    if (block && !block->ok()) return block->problem();
  }
  if (those_with_a_mesh().empty()) return std::optional<Above>();
  const BlockGrid grid = grid_of(plan_);
  const auto mesh_at = [&](std::int32_t column, std::int32_t row) -> const proto::TileMesh* {
    const auto k = grid.number_at(column, row);
    return k && blocks_[static_cast<std::size_t>(*k)] ? &(*blocks_[static_cast<std::size_t>(*k)])->mesh : nullptr;
  };
  return std::optional<Above>(
      Above{std::move(ground_), joined_mesh({grid.across, grid.up, static_cast<std::int32_t>(side), mesh_at})});
}

std::vector<proto::TileAddress> GatheredBlocks::those_with_a_mesh() const {
  std::vector<proto::TileAddress> those;
  for (std::size_t k = 0; k < count(); ++k) {
    if (blocks_[k]) those.push_back(nodes_[k]);
  }
  return those;
}

}  // namespace cordillera::pipeline
