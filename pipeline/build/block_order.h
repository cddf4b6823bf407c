#pragma once
// In what order the blocks of a build are made: as they were given, but those first that somebody looks at.
#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
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
  /// At most so many, of those that somebody looks at; none: nobody looks at any that was not given.
  std::vector<std::size_t> looked_at(std::size_t most);
  /// At most so many of these, which need not be looked at.
  std::vector<std::size_t> those(const std::function<bool(const proto::TileAddress&)>& are, std::size_t most);

 private:
  std::vector<proto::TileAddress> looked_at_now() const;
  std::optional<std::size_t> next_under(const std::vector<proto::TileAddress>& tiles) const;

  const std::vector<proto::TileAddress> blocks_;
  BlockFollower* const follower_;
  std::mutex mutex_;
  std::vector<bool> given_;
  std::size_t first_ = 0;  ///< that was not given yet
};

}  // namespace cordillera::pipeline
