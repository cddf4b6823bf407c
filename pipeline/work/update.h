#pragma once
// A dataset whose rasters change: its store keeps the plan and the meshes of its tasks, so the next version costs the tasks whose
// keys are new. What comes of it is, tile by tile, what a build of the same rasters with the same numbers gives.
#include <atomic>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/store_revise.h"
#include "work.pb.h"

namespace cordillera::pipeline::work {

struct UpdateOrder {
  BuildRequest request;       ///< members are set, in order; store_path: where the version goes; an unfinished one is continued
  std::string before;         ///< the published store of the version before; empty: none, all is to be built
  std::vector<Note> notes{};  ///< for the store
  /// Of the blocks of the first version. So large, they can be shown one by one while they are built.
  std::int64_t least_block_samples = kSmallExactSamples;
};

/// Blocks of the first version: so many where there are enough samples, so that a hundredth of the data touches few of them.
inline constexpr std::int64_t kUpdateBlocks = 1024;

/// Finest samples that a block of the first version has at most: what BuildRequest::block_samples is to say for its provisional
/// tiles. Reads no pixel.
proto::Result<std::int64_t> first_block_samples(const BuildRequest& request, const raster::Source& source);

/// Stages of progress are those of build(). Problems: those of build().
proto::Result<proto::Manifest> update(const UpdateOrder& order, const ProgressCallback& progress, const std::atomic<bool>& stop);

/// The plan that a store was made by; nullopt: it was not made to be updated, or by another version of the program or of the
/// format.
std::optional<proto::WorkPlan> plan_in(const std::string& store_path);

}  // namespace cordillera::pipeline::work
