#pragma once
// Blocks, and the levels above them: the tasks of a build. A task needs nothing but the plan, its node and the source (the levels
// above: what blocks have left), so it can run in any order, anywhere, twice, with the same bytes.
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/build/exact/gathered_blocks.h"
#include "pipeline/build/exact_build.h"
#include "pipeline/build/regions_above.h"
#include "pipeline/build/tile_strategy.h"
#include "pipeline/build/water_build.h"
#include "pipeline/build/worker_sources.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"
#include "raster/pixels/shared_pixels.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// What a build may use; it changes no byte, but for the last.
struct Room {
  std::string device;             ///< "auto", "cpu", "cuda", "cuda:N"
  std::uint32_t memory_mib = 0;   ///< 0: as much as there is
  std::int32_t quarter_side = 0;  ///< see BuildRequest
};

class Builder {
 public:
  using OpenSource = WorkerSources::Open;

  Builder(const proto::Plan& plan, Workers& workers, OpenSource open, Room room, const std::atomic<bool>& stop);
  /// Opens sources, and begins to open the device: one that cannot be used is a problem of this, or of the first task.
  proto::Result<void> prepare();
  proto::Result<void> opened() const;  ///< waits for the device; its problem
  std::string device() const;          ///< where tiles are made now: a GPU that fails gives way to the CPU, and the words say so
  /// The targets are in the plan's copy that the caller changed: take them over. alone: nodes are samples of a dry run, each for
  /// itself.
  void use(const proto::Plan& plan, bool alone = false);

  // Tasks may be made side by side, each in a thread of its own; they share the workers.

  /// How many blocks keep the threads busy, or as many as there is memory for. Each holds the samples of its block, and its
  /// finest meshes.
  std::size_t tasks_at_once() const;
  /// How many more there may be of blocks for whom nobody waits: while a GPU is busy, or being opened, threads read the next
  /// ones. No further than that, before there is room for them.
  std::size_t tasks_ahead() const;

  /// Tiles of all levels below and including the block, from the finest up, and their water masks. share: how much of it is done,
  /// 0 to 1; called by any thread.
  proto::Result<FinishedTask> block(const proto::TileAddress& node, const std::function<void(double)>& share,
                                    const FinestSink& finest = {});
  /// The mesh that a finished task left for its parent; nullopt where it has none. Called by any thread.
  using ChildMesh = GatheredBlocks::MeshOf;
  /// What blocks leave for a merge of all of them is kept for it from now on, where there is memory for that; else, or if another
  /// process made them, it is read.
  void gather_for_merge();
  /// All levels above the blocks, of what these have left. share: as of block().
  proto::Result<FinishedTask> merge(const ChildMesh& mesh_of, const std::function<void(double)>& share);

  /// A node whose block is made several times, with targets that differ: what is read of it stays.
  struct SampleBlock {
    proto::TileAddress node;
    BlockPlace place;        ///< of its data
    proto::Samples samples;  ///< of it and a little around; all_void(): there is no data
  };
  proto::Result<SampleBlock> sample_block(const proto::TileAddress& node);
  /// Published triangles of so many levels, the finest first.
  proto::Result<std::vector<double>> count(const SampleBlock& block, int levels);

 private:
  /// The finest samples of a node; they hold all of its place, or nothing.
  proto::Result<SampleBlock> read(const proto::TileAddress& node, Workers::Haste haste);
  std::vector<raster::PixelPoint> pixels_in(const proto::TileAddress& tile, unsigned worker);
  bool is_empty(const raster::Source::Window& window);
  bool by_regions() const;  ///< whether levels above blocks are made in regions; else of one ground
  proto::Result<FinishedTask> tiles_of_block(const proto::TileAddress& node, const std::function<void(double)>& share,
                                             const FinestSink& finest);
  /// Reads what of the window its samples hold; those lie within the window or are void already.
  proto::Result<void> read_into(const raster::Source::Window& window, proto::Samples& samples,
                                Workers::Haste haste = Workers::Haste::none);

  proto::Plan plan_;
  bool alone_ = false;
  proto::Lattice lattice_;
  Workers& workers_;
  OpenSource open_;
  const Room room_;
  const std::atomic<bool>& stop_;
  std::shared_ptr<raster::SharedPixels> pixels_;  ///< of all sources; null before prepare()
  WorkerSources sources_;
  BlockWater water_;
  class BlockRoom;  ///< of a block that goes on after it was read
  std::mutex rooms_mutex_;
  std::condition_variable room_free_;
  std::size_t rooms_taken_ = 0;
  TileStrategy strategy_;
  ExactSimplifiers exact_;
  std::unique_ptr<GatheredBlocks> gathered_;  ///< since gather_for_merge()
};

}  // namespace cordillera::pipeline
