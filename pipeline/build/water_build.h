#pragma once
// Water masks of a dataset: a block makes those of its tiles, and when all blocks are there those above them are made of theirs.
#include <atomic>
#include <string>
#include <vector>

#include "pipeline/build/worker_sources.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Of blocks. With water= the pixels of exactly that height are water, with water-mask= those that are not zero there; what
/// neither raster covers is land. Borrows what it is given; several threads may ask it.
class BlockWater {
 public:
  /// heights: handles on the elevation model, one a worker.
  BlockWater(const proto::Plan& plan, Workers& workers, WorkerSources& heights);
  /// Once, before all else. Problems: those of the mask, which name the option.
  proto::Result<void> open();
  /// Masks of a block's tiles on all its levels, the finest first; none without water= and water-mask=.
  proto::Result<std::vector<TileWater>> of(const proto::TileAddress& block);

 private:
  const proto::Plan& plan_;
  Workers& workers_;
  WorkerSources& heights_;
  WorkerSources mask_;
};

/// Those above the blocks, once all of these are in the store.
proto::Result<void> build_water_above(const proto::Plan& plan, StoreWriter& store, const std::atomic<bool>& stop);

/// The mask opens and lies somewhere: asked before hours of building. Nothing without water-mask=.
proto::Result<void> check_water(const proto::BuildOptions& options);

/// A sentence where the mask of water-mask= covers nothing of a source; else, and where the mask cannot be opened, nothing.
std::string note_on_mask(const proto::BuildOptions& options, const proto::Source& source);

}  // namespace cordillera::pipeline
