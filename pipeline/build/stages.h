#pragma once
// The driver of every build in one process: blocks, then what is made above them, stage by stage. A task is committed to the
// store when it is done, so a build that was ended goes on there. What differs between builds is which tasks there are.
#include <atomic>
#include <future>
#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/build/builder.h"
#include "pipeline/progress/teller.h"
#include "pipeline/store/store.h"
#include "pipeline/threads/workers.h"

namespace cordillera::pipeline {

/// As asked for. "auto" is the CPU for exact blocks of so few samples that its threads are done with them before a GPU is open:
/// that, and to close it, takes a third of a second. The bytes are the same.
std::string device_of(const proto::Plan& plan, const std::string& asked, unsigned threads);

/// Brings up the device while the plan is made, which takes it a quarter of a second once a process: where it is sure to be used.
/// Whoever destroys it waits until it is up.
std::future<void> wake_device(const proto::BuildOptions& options, const proto::Source& source);

/// Threads, and on them a builder of a plan, with handles of its own on the request's sources. request and stop outlive it.
struct Workshop {
  Workshop(const BuildRequest& request, const proto::Plan& plan, const std::atomic<bool>& stop);
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;

  Workers workers;
  const Builder::OpenSource open;
  Builder builder;  ///< to be prepared
};

/// Meshes in the store that a task has used. kept: the next version may need them.
enum class Consumed : std::uint8_t { removed, kept };

/// Where tasks are made and where they go. All of it outlives the call.
struct Site {
  const proto::Plan& plan;
  Workshop& shop;  ///< of this plan, prepared
  StoreWriter& store;
  Teller& teller;
  BlockFollower* follower;  ///< may be null
  Consumed consumed;
  const std::atomic<bool>& stop;
};

/// Nodes of the tasks: those of blocks, then those above them, stage by stage. A stage needs what the ones before it left.
using Stages = std::vector<std::vector<proto::TileAddress>>;
/// Of a plan whose window has data everywhere, as far as is known.
Stages stages_of(const proto::Plan& plan);

/// Makes the tasks that the store does not have yet, and water masks. Then all tiles are in the store, to be published. Problems:
/// those of the tasks and of the store; "cancelled"; "paused" as build() has it.
proto::Result<void> make_stages(const Site& site, const Stages& stages);

}  // namespace cordillera::pipeline
