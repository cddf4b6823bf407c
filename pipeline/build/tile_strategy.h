#pragma once
// A published algorithm in the place of exact, tile by tile: the sides of a block's tiles stay, so tiles fit together as those of
// exact do, and what is between them is simplified anew. Levels above blocks are those of exact.
#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gpu/simplify.h"
#include "pipeline/threads/workers.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

class TileStrategy {
 public:
  /// Both outlive it.
  TileStrategy(Workers& workers, const std::atomic<bool>& stop) : workers_(workers), stop_(stop) {}
  /// Once, before all else. device: as gpu::make_simplifier has it, and its problems. Of a plan of exact nothing is opened.
  proto::Result<void> open(const std::string& device, const proto::Plan& plan);
  /// Whether tiles are to be made anew.
  bool is_open() const { return !on_cpu_.empty(); }
  std::string device() const;  ///< where tiles are made now, and what became of a device that was lost

  /// Makes a tile of a block anew, by one of the workers, and measures it. tile: whole; its sides stay. It has published
  /// triangles alone then, and vertices put back where the context says so. Where a triangle stays above the target, the next
  /// attempt begins with twice as many rows, and keeps all samples there. The tile stays that of exact beside a pole, where no
  /// attempt helps, where less of the data would be shown or a triangle is upside down, and once it is told to stop. Many threads
  /// may work on as many tiles.
  void simplify(const LevelContext& context, BuiltTile& tile, unsigned worker);

 private:
  proto::TileMesh run_engine(const gpu::SimplifyJob& job, unsigned worker);

  Workers& workers_;
  const std::atomic<bool>& stop_;
  proto::BuildOptions options_;
  std::vector<std::unique_ptr<gpu::Simplifier>> on_cpu_;  ///< one a worker
  mutable std::mutex device_mutex_;
  std::atomic<bool> has_device_{false};         ///< asked while another tile holds the mutex
  std::unique_ptr<gpu::Simplifier> on_device_;  ///< one tile at a time; none: there is no GPU, or it was lost
  std::string lost_;                            ///< how
};

}  // namespace cordillera::pipeline
