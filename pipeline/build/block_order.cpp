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

/// The block of the first of these tiles whose block is still to be made.
std::optional<std::size_t> BlockOrder::next_under(const std::vector<proto::TileAddress>& tiles) const {
  if (blocks_.empty()) return std::nullopt;
  const int level = blocks_.front().z;
  for (const proto::TileAddress& tile : tiles) {
    if (tile.z < level) continue;  // of many blocks
    const auto found = std::find(blocks_.begin(), blocks_.end(), tile.at_level(level));
    if (found == blocks_.end()) continue;
    const auto k = static_cast<std::size_t>(found - blocks_.begin());
    if (!given_[k]) return k;
  }
  return std::nullopt;
}

}  // namespace cordillera::pipeline
