#pragma once
// The task of an exact plan: a block simplified by gpu/exact, all its levels, each tile measured and encoded while the next level is made.
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "pipeline/build/exact_above.h"
#include "pipeline/build/exact_block.h"
#include "pipeline/store/store.h"
#include "pipeline/tile/tile_mesh.h"
#include "pipeline/build/workers.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Simplifiers of blocks: a device's, and the CPU's, which steps in when the device is lost. One block at a time, on all threads.
class ExactSimplifiers {
 public:
  ExactSimplifiers(Workers& workers, const std::atomic<bool>& stop) : workers_(workers), stop_(stop) {}
  proto::Result<void> open(const std::string& device);
  std::string device() const;  ///< where blocks are made now, and what became of a device that was lost

  using TakeLevel = std::function<void(std::size_t level, gpu::exact::BlockMesh&& mesh)>;
  using TakeSquares = std::function<void(gpu::exact::Squares&& squares)>;
  /// May be called by several threads; levels come in order, by the caller's thread. If a device is lost, all come again. squares: before the
  /// levels; may be empty.
  proto::Result<void> simplify(const gpu::exact::Block& block, const gpu::exact::BlockPlan& plan, const TakeLevel& take, const TakeSquares& squares);
  /// Likewise, levels above blocks.
  proto::Result<void> simplify_above(const Above& above, const gpu::exact::BlockPlan& plan, const TakeLevel& take);

 private:
  /// On the device; where it is lost, on the CPU.
  proto::Result<void> call(const std::function<proto::Result<void>(gpu::exact::BlockSimplifier&)>& work);
  gpu::exact::Watch watch(const TakeLevel& take) const;
  gpu::ParallelFor on_all_threads();

  Workers& workers_;
  const std::atomic<bool>& stop_;
  std::mutex calls_;           ///< one block at a time
  mutable std::mutex mutex_;   ///< of what follows
  std::unique_ptr<gpu::exact::BlockSimplifier> on_device_, on_cpu_;
  std::string lost_;
};

/// The source's pixels in a tile of the finest level, read by one of the workers.
using ReadPixels = std::function<std::vector<raster::PixelPoint>(const proto::TileAddress& tile, unsigned worker)>;
struct BlockTeam {
  Workers& workers;
  const ReadPixels& pixels;
};

/// All tiles of a node's block, from samples that hold it (see BlockPlace::empty_samples), and its mesh where levels are merged above. share: as in
/// Builder::block, from where the samples are there to 1.
proto::Result<FinishedTask> build_exact_block(const proto::Plan& plan, const proto::TileAddress& node, const BlockPlace& place,
                                              const proto::Samples& samples, ExactSimplifiers& simplifiers, const BlockTeam& team,
                                              const std::function<void(double)>& share);

/// All tiles above the blocks, see merged_at_once. kept: indexed as node_at; null where a block has no data.
proto::Result<FinishedTask> build_exact_above(const proto::Plan& plan, const std::vector<const KeptBlock*>& kept, ExactSimplifiers& simplifiers,
                                              Workers& workers);

}  // namespace cordillera::pipeline
