#include "pipeline/work/work.h"

#include <algorithm>
#include <map>

#include "pipeline/builder.h"
#include "pipeline/work/shard.h"
#include "pipeline/work/work_plan.h"

namespace cordillera::pipeline::work {
namespace {

constexpr double kMergeCost = 1 << 20;  // samples a second of a block, about; a merge is somewhat more than a second

using proto::Problem;

class Worker {
 public:
  Worker(const proto::WorkPlan& plan, const proto::WorkStage& stage, const WorkOrder& order, const std::atomic<bool>& stop)
      : plan_(plan), order_(order), stop_(stop), workers_(order.threads) {
    // Keys of the stage below, which hold the meshes to be merged.
    for (int k = 1; k < plan.stages_size(); ++k) {
      if (&plan.stages(k) != &stage) continue;
      for (const proto::WorkTask& task : plan.stages(k - 1).tasks()) below_[address_of(task)] = &task;
    }
  }

  proto::Result<FinishedTask> work(const proto::WorkTask& task) {
    const bool block = task.sources_size() > 0;
    std::vector<raster::MosaicMember> members = members_of(plan_, task);
    for (const raster::MosaicMember& member : members) {
      if (const auto same = check_unchanged(member); !same.ok()) return same.problem();
    }
    const double feather_m = plan_.options().feather();
    // A merge reads no raster. One raster alone is a mosaic of one.
    const auto open = [&]() -> proto::Result<std::unique_ptr<raster::Source>> {
      return block ? raster::make_mosaic(members, feather_m) : std::unique_ptr<raster::Source>();
    };
    Builder builder(plan_.plan(), workers_, open, order_.device, stop_);
    if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
    return block ? builder.block(address_of(task), [](double) {}) : merge(builder, task);
  }

 private:
  proto::Result<FinishedTask> merge(Builder& builder, const proto::WorkTask& task) {
    std::map<proto::TileAddress, std::string> meshes;
    for (int c = 0; c < 4; ++c) {
      const proto::TileAddress child = address_of(task).child(c);
      const auto found = below_.find(child);
      if (found == below_.end()) continue;
      const auto mesh = read_shard_mesh(order_.folder, *found->second);
      if (!mesh.ok()) return mesh.problem();
      if (*mesh) meshes[child] = **mesh;
    }
    return builder.merge(address_of(task), [&](const proto::TileAddress& child) -> std::optional<std::string> {
      const auto found = meshes.find(child);
      return found == meshes.end() ? std::nullopt : std::optional(found->second);
    });
  }

  const proto::WorkPlan& plan_;
  const WorkOrder& order_;
  const std::atomic<bool>& stop_;
  Workers workers_;
  std::map<proto::TileAddress, const proto::WorkTask*> below_;
};

}  // namespace

double cost_of(const proto::WorkTask& task) { return task.sources_size() > 0 ? task.samples() : kMergeCost; }

std::vector<std::size_t> part_of(const proto::WorkStage& stage, std::size_t part, std::size_t parts) {
  double total = 0, before = 0;
  for (const proto::WorkTask& task : stage.tasks()) total += cost_of(task);
  std::vector<std::size_t> chosen;
  for (int k = 0; k < stage.tasks_size(); ++k) {
    const double cost = cost_of(stage.tasks(k)), middle = before + cost / 2;
    before += cost;
    const auto falls_into = std::min(parts - 1, static_cast<std::size_t>(middle / total * static_cast<double>(parts)));
    if (falls_into == part) chosen.push_back(static_cast<std::size_t>(k));
  }
  return chosen;
}

proto::Result<void> do_tasks(const proto::WorkPlan& plan, const proto::WorkStage& stage, const std::vector<std::size_t>& tasks,
                             const WorkOrder& order, const TaskEnded& ended, const std::atomic<bool>& stop) {
  Worker worker(plan, stage, order, stop);
  for (const std::size_t k : tasks) {
    if (stop) return Problem{"cancelled", "the work was cancelled", "", ""};
    const proto::WorkTask& task = stage.tasks(static_cast<int>(k));
    if (read_shard(order.folder, task).ok()) {
      ended(task, Outcome::was_done);
      continue;
    }
    const auto finished = worker.work(task);
    if (!finished.ok()) return finished.problem();
    if (const auto written = write_shard(order.folder, task, *finished); !written.ok()) return written.problem();
    ended(task, Outcome::done);
  }
  return {};
}

bool worth_retrying(const proto::Problem& problem) {
  for (const char* type : {"storage-read", "storage-write", "shard-missing", "shard-damaged", "cancelled"}) {
    if (problem.type == type) return true;
  }
  return false;
}

}  // namespace cordillera::pipeline::work
