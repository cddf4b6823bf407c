#include "pipeline/build/block_order.h"

#include <algorithm>

namespace cordillera::pipeline {

BlockOrder::BlockOrder(std::vector<proto::TileAddress> blocks, BlockFollower* follower)
    : blocks_(std::move(blocks)), follower_(follower), given_(blocks_.size(), false) {}

std::size_t BlockOrder::next() {
  const std::lock_guard lock(mutex_);
  while (first_ < given_.size() && given_[first_]) ++first_;
  const std::size_t k = chosen();
  given_[k] = true;
  return k;
}

/// The block under the tile that was looked at last and whose block is still to be made.
std::size_t BlockOrder::chosen() const {
  if (!follower_) return first_;
  for (const proto::TileAddress& tile : follower_->looked_at()) {
    const int level = blocks_[first_].z;
    if (tile.z < level) continue;  // of many blocks
    const auto found = std::find(blocks_.begin(), blocks_.end(), tile.at_level(level));
    if (found == blocks_.end()) continue;
    const auto k = static_cast<std::size_t>(found - blocks_.begin());
    if (!given_[k]) return k;
  }
  return first_;
}

}  // namespace cordillera::pipeline
