#pragma once
// What exact blocks leave for the levels above them, gathered for the task that makes all of those at once.
#include <atomic>
#include <cstddef>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/build/exact/exact_above.h"
#include "pipeline/build/exact/kept_block.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"

namespace cordillera::pipeline {

class GatheredBlocks {
 public:
  /// Of a plan with levels above its blocks. It borrows all three.
  GatheredBlocks(const proto::Plan& plan, Workers& workers, const std::atomic<bool>& stop);
  std::size_t count() const { return nodes_.size(); }
  /// Of the ground.
  double bytes() const;

  /// From now on what a block leaves is put in its place as soon as it is there. The ground's memory, which takes as long to be
  /// had as many blocks to be read, is had meanwhile.
  void begin();
  /// A finished block's. Called by any thread, at any time after begin().
  void take(const FinishedTask& block);

  /// The mesh that a block left, as the store has it; nullopt where it left none.
  using MeshOf = std::function<proto::Result<std::optional<std::string>>(const proto::TileAddress& block)>;
  /// All of it, once all blocks are there; those that were not taken are read. Nothing, where none left anything, and where it is
  /// stopped. Problems: those of mesh_of and kept_block_from().
  proto::Result<std::optional<Above>> all(const MeshOf& mesh_of);
  /// The blocks that did.
  std::vector<proto::TileAddress> those_with_a_mesh() const;

 private:
  void make_ground();
  void place(std::size_t k, KeptBlock&& block);

  const proto::Plan& plan_;
  Workers& workers_;
  const std::atomic<bool>& stop_;
  const float code_unit_;
  const std::vector<proto::TileAddress> nodes_;
  std::vector<std::optional<proto::Result<KeptBlock>>> blocks_;  ///< indexed as nodes_; without squares once these are placed
  std::atomic<bool> voids_{false};
  gpu::exact::Ground ground_;
  std::shared_future<void> ground_there_;  ///< since begin()
};

}  // namespace cordillera::pipeline
