#pragma once
// Who simplifies tiles one by one: a device, a batch at a time, and the CPU, which steps in when the device is lost. Blocks that
// are simplified whole: exact/exact_simplifiers.h.
#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gpu/simplify.h"
#include "pipeline/threads/workers.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

class TileSimplifiers {
 public:
  /// Both outlive it.
  TileSimplifiers(Workers& workers, const std::atomic<bool>& stop) : workers_(workers), stop_(stop) {}
  /// Once, before all else. device, strategy: as gpu::make_simplifier has them, and its problems.
  proto::Result<void> open(const std::string& device, const std::string& strategy);
  std::string device() const;  ///< where tiles are made now, and what became of a device that was lost

  /// Makes tile k of a level ready; nullopt: it has no data. Called by any thread.
  using Prepare = std::function<std::optional<PreparedTile>(std::size_t k)>;
  /// Called after every tile, by any thread.
  using TileDone = std::function<void()>;
  /// Tiles 0 .. count - 1 of a level, those without data left out. Some are missing when the build was stopped. May be called by
  /// several threads.
  std::vector<BuiltTile> simplify(
      const LevelContext& context, std::size_t count, const Prepare& prepare, const TileDone& done = [] {});

 private:
  void simplify_on_cpu(const LevelContext& context, const Prepare& prepare, std::vector<std::optional<BuiltTile>>& tiles,
                       const TileDone& done);
  void simplify_batched(const LevelContext& context, const Prepare& prepare, std::vector<std::optional<BuiltTile>>& tiles);
  void simplify_batch(const LevelContext& context, std::vector<PreparedTile>& prepared,
                      std::vector<std::optional<BuiltTile>>& built);
  std::vector<proto::TileMesh> simplify_on_device(const std::vector<gpu::SimplifyJob>& jobs);

  Workers& workers_;
  const std::atomic<bool>& stop_;
  std::vector<std::unique_ptr<gpu::Simplifier>> on_cpu_;  ///< one a worker
  mutable std::mutex device_mutex_;
  std::atomic<bool> has_device_{false};         ///< asked while another task's batch holds the mutex
  std::unique_ptr<gpu::Simplifier> on_device_;  ///< one task's batch at a time; none: there is no GPU, or it was lost
  std::string lost_;                            ///< how
};

}  // namespace cordillera::pipeline
