#pragma once
// In what order the blocks of a build are made: as they were given, but those first that somebody looks at.
#include <cstddef>
#include <mutex>
#include <vector>

#include "pipeline/build/build.h"

namespace cordillera::pipeline {

/// Gives out blocks, each once. Bytes do not depend on their order. Thread-safe.
class BlockOrder {
 public:
  /// blocks: of the plan's block level. follower: says what is looked at; may be null.
  BlockOrder(std::vector<proto::TileAddress> blocks, BlockFollower* follower);
  /// An index of blocks. To be called once for each of them, at most.
  std::size_t next();

 private:
  std::size_t chosen() const;

  const std::vector<proto::TileAddress> blocks_;
  BlockFollower* const follower_;
  std::mutex mutex_;
  std::vector<bool> given_;
  std::size_t first_ = 0;  ///< that was not given yet
};

}  // namespace cordillera::pipeline
