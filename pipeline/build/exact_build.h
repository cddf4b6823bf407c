#pragma once
// The task of a plan: a block simplified by gpu/exact, all its levels, each tile measured and encoded while the next level is
// made.
#include <functional>
#include <vector>

#include "pipeline/build/exact/exact_above.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/exact/exact_simplifiers.h"
#include "pipeline/build/tile_strategy.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"
#include "pipeline/tile/tile_mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Who wants the tiles of a block's finest level as soon as these are done; nobody, if empty.
struct FinestSink {
  std::function<bool()> waits;  ///< whether anybody does at the moment; of what is made because somebody looked, always
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
  TileStrategy& strategy;  ///< makes tiles anew where it is open
};

/// All tiles of a node's block, from samples that hold it (see BlockPlace::empty_samples), and its mesh where levels are merged
/// above. share: as in Builder::block, from where the samples are there to 1.
proto::Result<FinishedTask> build_block(const proto::Plan& plan, const proto::TileAddress& node, const BlockPlace& place,
                                        const proto::Samples& samples, ExactSimplifiers& simplifiers, const BlockReaders& team,
                                        const std::function<void(double)>& share);

/// Who counts: threads alone where tiles are made anew.
struct BlockCounters {
  ExactSimplifiers& simplifiers;
  Workers& workers;
  TileStrategy& strategy;
};
/// Published triangles of its levels alone, the finest first. coarsest: may be above the plan's block level.
proto::Result<std::vector<double>> count_block(const proto::Plan& plan, int coarsest, const BlockPlace& place,
                                               const proto::Samples& samples, const BlockCounters& team);

/// All tiles above the blocks. share: as in Builder::block, by one thread.
proto::Result<FinishedTask> build_above(const proto::Plan& plan, Above above, ExactSimplifiers& simplifiers, Workers& workers,
                                        const std::function<void(double)>& share);

}  // namespace cordillera::pipeline
