#pragma once
// One task of a plan, done by whoever is told to: pure, idempotent, safe to run twice at once.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "pipeline/build/build.h"
#include "work.pb.h"

namespace cordillera::pipeline::work {

struct WorkOrder {
  std::string folder;                ///< of the plan; shards go below it
  std::vector<std::string> devices;  ///< auto, cpu, cuda, cuda:N; each is one worker's, who takes the dearest task that is left
  unsigned threads = 0;              ///< of all workers together; 0: one for each usable core
  std::uint32_t memory_mib = 0;      ///< what all workers together fit blocks and regions into; 0: as much as there is
  std::size_t begin = 0;             ///< which of the tasks comes first, by any number: those before it come last
};

/// Tasks `part` of `parts` of a stage: neighbours in the stage's order, with about equal cost. part 0 … parts - 1; may be empty.
std::vector<std::size_t> part_of(const proto::WorkStage& stage, std::size_t part, std::size_t parts);

/// Cost of a task relative to others: finest samples to read, or what a merge costs in those. Never 0.
double cost_of(const proto::WorkTask& task);

enum class TaskOutcome { done, was_done, failed };
/// Called after every task, by one worker at a time.
using TaskEnded = std::function<void(const proto::WorkTask&, TaskOutcome)>;

/// Does the tasks, with one device in order, and writes their shards. One whose shard is there, whole and undamaged, is not done
/// again. Problems of a raster leave tasks without it alone, and come at the end: "source-changed" (a raster or its geoid is not
/// as planned, or was written to meanwhile) and those of reading; of several tasks "tasks-failed". At once come those of all
/// tasks: "shard-missing" (a stage below is not finished), "shard-damaged", "storage-write", "storage-read", "cancelled", and
/// those of the device.
proto::Result<void> do_tasks(const proto::WorkPlan& plan, const proto::WorkStage& stage, const std::vector<std::size_t>& tasks,
                             const WorkOrder& order, const TaskEnded& ended, const std::atomic<bool>& stop);

/// Whether trying again later, elsewhere, may help: storage, full disks and missing stages, not bad input.
bool worth_retrying(const proto::Problem& problem);

}  // namespace cordillera::pipeline::work
