#include "pipeline/build/block_order.h"

#include <algorithm>

namespace cordillera::pipeline {

BlockOrder::BlockOrder(std::vector<proto::TileAddress> blocks, BlockFollower* follower)
    : blocks_(std::move(blocks)), follower_(follower), given_(blocks_.size(), false) {}

std::size_t BlockOrder::next() {
  const std::lock_guard lock(mutex_);
  while (first_ < given_.size() && given_[first_]) ++first_;
  const std::size_t k = next_under(looked_at_now()).value_or(first_);
  given_[k] = true;
  return k;
}

std::vector<std::size_t> BlockOrder::looked_at(std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<std::size_t> found;
  const std::vector<proto::TileAddress> tiles = looked_at_now();
  while (found.size() < most) {
    const auto k = next_under(tiles);
    if (!k) break;
    given_[*k] = true;
    found.push_back(*k);
  }
  return found;
}

std::vector<std::size_t> BlockOrder::those(const std::function<bool(const proto::TileAddress&)>& are, std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < blocks_.size() && found.size() < most; ++k) {
    if (given_[k] || !are(blocks_[k])) continue;
    given_[k] = true;
    found.push_back(k);
  }
  return found;
}

std::vector<proto::TileAddress> BlockOrder::looked_at_now() const {
  return follower_ ? follower_->looked_at() : std::vector<proto::TileAddress>();
}

/// The block of the first of these tiles whose block is still to be made; behind them, for a tile of level 0, any below it.
/// Others above the blocks stand for none: a map that is zoomed out asks for them.
std::optional<std::size_t> BlockOrder::next_under(const std::vector<proto::TileAddress>& tiles) const {
  if (blocks_.empty()) return std::nullopt;
  const int level = blocks_.front().z;
  const auto next = [&](const auto& is_wanted) -> std::optional<std::size_t> {
    for (std::size_t k = first_; k < blocks_.size(); ++k) {
      if (!given_[k] && is_wanted(blocks_[k])) return k;
    }
    return std::nullopt;
  };
  for (const proto::TileAddress& tile : tiles) {
    if (tile.z < level) continue;
    const proto::TileAddress wanted = tile.at_level(level);
    if (const auto k = next([&](const proto::TileAddress& block) { return block == wanted; })) return k;
  }
  for (const proto::TileAddress& tile : tiles) {
    if (tile.z > 0 || level == 0) continue;
    if (const auto k = next([&](const proto::TileAddress& block) { return block.at_level(tile.z) == tile; })) return k;
  }
  return std::nullopt;
}

}  // namespace cordillera::pipeline
