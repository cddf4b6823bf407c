#pragma once
// The task of an exact plan: a block simplified by gpu/exact, all its levels, each tile measured and encoded while the next level
// is made.
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "pipeline/build/exact/exact_above.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/workers.h"
#include "pipeline/store/store.h"
#include "pipeline/tile/tile_mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Simplifiers of blocks, one for each call that is under way: of a device, and of the CPU, which steps in when the device is
/// lost. Each uses all threads.
class ExactSimplifiers {
 public:
  ExactSimplifiers(Workers& workers, const std::atomic<bool>& stop) : workers_(workers), stop_(stop) {}
  /// at_once: no more blocks are simplified side by side.
  proto::Result<void> open(const std::string& device, std::size_t at_once);
  std::string device() const;  ///< where blocks are made now, and what became of a device that was lost

  using TakeLevel = std::function<void(std::size_t level, gpu::exact::BlockMesh&& mesh)>;
  using TakeSquares = std::function<void(gpu::exact::Squares&& squares)>;
  /// May be called by several threads; levels come in order, by the caller's thread. If a device fails, all come again. squares:
  /// before the levels; may be empty.
  proto::Result<void> simplify(const gpu::exact::Block& block, const gpu::exact::BlockPlan& plan, const TakeLevel& take,
                               const TakeSquares& squares);
  /// Likewise, levels above blocks.
  proto::Result<void> simplify_above(const Above& above, const gpu::exact::BlockPlan& plan, const TakeLevel& take);

 private:
  using Work = std::function<proto::Result<void>(gpu::exact::BlockSimplifier&)>;
  /// A simplifier in use.
  struct Turn {
    std::unique_ptr<gpu::exact::BlockSimplifier> simplifier;
    bool on_device = false;
    bool alone = false;  ///< no other is in use, nor will be meanwhile
  };
  /// On the device; where it is lost, on the CPU.
  proto::Result<void> call(const Work& work);
  Turn begin();  ///< waits until fewer than at_once_ are in use
  void end(Turn turn);
  void failed(const Turn& turn, const std::string& how);
  gpu::exact::Watch watch(const TakeLevel& take) const;
  gpu::ParallelFor on_all_threads();

  Workers& workers_;
  const std::atomic<bool>& stop_;
  mutable std::mutex mutex_;  ///< of all that follows
  std::condition_variable changed_;
  std::size_t at_once_ = 1, in_use_ = 0;
  std::string wanted_ = "cpu", device_ = "cpu";                     ///< as asked for, and as it calls itself
  std::vector<std::unique_ptr<gpu::exact::BlockSimplifier>> idle_;  ///< of device_
  std::string lost_;
};

/// Who wants the tiles of a block's finest level as soon as these are done; nobody, if empty.
struct FinestSink {
  std::function<bool()> waits;  ///< whether anybody does at the moment
  std::function<void(const std::vector<EncodedTile>& tiles)> take;
  explicit operator bool() const { return take != nullptr; }
  Workers::Haste haste() const { return take && waits() ? Workers::Haste::somebody_waits : Workers::Haste::none; }
};

/// The source's pixels in a tile of the finest level, read by one of the workers.
using ReadPixels = std::function<std::vector<raster::PixelPoint>(const proto::TileAddress& tile, unsigned worker)>;
struct BlockReaders {
  Workers& workers;
  const ReadPixels& pixels;
  const FinestSink& finest;
};

/// All tiles of a node's block, from samples that hold it (see BlockPlace::empty_samples), and its mesh where levels are merged
/// above. share: as in Builder::block, from where the samples are there to 1.
proto::Result<FinishedTask> build_exact_block(const proto::Plan& plan, const proto::TileAddress& node, const BlockPlace& place,
                                              const proto::Samples& samples, ExactSimplifiers& simplifiers,
                                              const BlockReaders& team, const std::function<void(double)>& share);

/// All tiles above the blocks, see merged_at_once. kept: indexed as node_at; null where a block has no data.
proto::Result<FinishedTask> build_exact_above(const proto::Plan& plan, const std::vector<const KeptBlock*>& kept,
                                              ExactSimplifiers& simplifiers, Workers& workers);

}  // namespace cordillera::pipeline
