#pragma once
// The end of a plan: all shards into one store, in one step.
#include <atomic>
#include <string>

#include "pipeline/build/build.h"
#include "pipeline/store/store.h"
#include "work.pb.h"

namespace cordillera::pipeline::work {

/// How many of the plan's shards are there, without reading them.
struct Progress {
  std::size_t done = 0, all = 0;
};
proto::Result<std::vector<Progress>> progress_of(const proto::WorkPlan& plan, const std::string& folder);  ///< a stage each

/// Checks that every shard is there, then every hash, and writes the store that a build in one process would have written: the
/// same tiles, the same bytes. store_path appears whole or stays as it was. Problems: "shards-missing" with the first of them,
/// "shard-damaged" of the first one, which is removed; "cancelled".
proto::Result<proto::Manifest> publish(const proto::WorkPlan& plan, const std::string& folder, const std::string& store_path,
                                       const std::atomic<bool>& stop);

/// The last step of a store that holds all tiles of a plan: its manifest. "no-data" where they are none.
proto::Result<proto::Manifest> publish_store(StoreWriter& store, const BuildRequest& request, const proto::WorkPlan& plan);

/// Removes shards below the folder that no task of the plan names; how many.
proto::Result<std::size_t> prune(const proto::WorkPlan& plan, const std::string& folder);

}  // namespace cordillera::pipeline::work
