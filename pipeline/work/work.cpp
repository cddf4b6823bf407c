#include "pipeline/work/work.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <set>

#include "pipeline/build/builder.h"
#include "pipeline/work/shard.h"
#include "pipeline/work/work_plan.h"
#include "proto/cores.h"
#include "raster/storage/storage.h"

namespace cordillera::pipeline::work {
namespace {

using proto::Problem;

/// A worker's share of the threads, at least one.
unsigned threads_of(const WorkOrder& order, std::size_t device) {
  const auto workers = static_cast<unsigned>(order.devices.size());
  if (workers == 1) return order.threads;
  const unsigned all = proto::threads_for(order.threads);
  return std::max(all / workers + (device < all % workers ? 1 : 0), 1u);
}

/// Tasks of a stage, one after the other on one device. Rasters that were opened for one stay open for the next.
class Worker {
 public:
  Worker(const proto::WorkPlan& plan, const proto::WorkStage& stage, const WorkOrder& order, std::size_t device,
         const std::atomic<bool>& stop)
      : plan_(plan),
        folder_(order.folder),
        request_(request_of(plan)),
        workers_(threads_of(order, device)),
        builder_(
            plan.plan(), workers_, [this, blocks = &stage == &plan.stages(0)] { return open(blocks); },
            {order.devices[device], order.memory_mib / static_cast<std::uint32_t>(order.devices.size())}, stop) {
    // Keys of the stage below, which hold the meshes to be merged.
    for (int k = 1; k < plan.stages_size(); ++k) {
      if (&plan.stages(k) != &stage) continue;
      for (const proto::WorkTask& task : plan.stages(k - 1).tasks()) below_[address_of(task)] = &task;
    }
  }

  /// Before the first task: its problem is that of all.
  proto::Result<void> prepare() {
    if (ready_) return {};
    const auto ready = builder_.prepare();
    ready_ = ready.ok();
    return ready;
  }

  /// Whether the device can be used, which is opened while the first task is read.
  proto::Result<void> opened() const { return builder_.opened(); }

  proto::Result<FinishedTask> work(const proto::WorkTask& task) {
    const std::vector<raster::MosaicMember> members = members_of(plan_, task);
    for (const raster::MosaicMember& member : members) {
      // Examined once: each time is an open, in object storage several requests.
      const std::string asked = member.path + "\n" + member.options.SerializeAsString();
      const auto check = examined_.contains(asked) ? check_state : check_unchanged;
      if (const auto same = unchanged(member, check); !same.ok()) return same.problem();
      examined_.insert(asked);
    }
    if (const auto same = mask_unchanged(task); !same.ok()) return same.problem();
    auto finished = task.sources_size() > 0 ? builder_.block(address_of(task), told_to_nobody) : merge();
    // Who writes into a raster meanwhile may have had its pixels read in part.
    for (const raster::MosaicMember& member : members) {
      if (const auto same = unchanged(member, check_state); !same.ok()) return same.problem();
    }
    if (const auto same = mask_unchanged(task); !same.ok()) return same.problem();
    return finished;
  }

 private:
  static void told_to_nobody(double) {}
  /// What was changed once stays refused, whatever its file says later: pixels of then may be in a cache.
  proto::Result<void> unchanged(const raster::MosaicMember& member, proto::Result<void> (*check)(const raster::MosaicMember&)) {
    if (const auto found = changed_.find(member.path); found != changed_.end()) return found->second;
    auto same = check(member);
    if (!same.ok() && same.problem().type == "source-changed") changed_.emplace(member.path, same.problem());
    return same;
  }
  /// Merges have the water of their blocks.
  proto::Result<void> mask_unchanged(const proto::WorkTask& task) {
    return mask_ && task.sources_size() > 0 ? unchanged(*mask_, check_state) : proto::Result<void>();
  }
  /// A merge reads no raster.
  proto::Result<std::unique_ptr<raster::Source>> open(bool blocks) const {
    return blocks ? open_source(request_) : proto::Result<std::unique_ptr<raster::Source>>(nullptr);
  }

  proto::Result<FinishedTask> merge() {
    using Mesh = proto::Result<std::optional<std::string>>;
    return builder_.merge(
        [&](const proto::TileAddress& child) -> Mesh {
          const auto found = below_.find(child);
          return found == below_.end() ? Mesh(std::nullopt) : read_shard_mesh(folder_, *found->second);
        },
        told_to_nobody);
  }

  const proto::WorkPlan& plan_;
  const std::string& folder_;
  const BuildRequest request_;
  const std::optional<raster::MosaicMember> mask_ = water_mask_of(plan_);
  Workers workers_;
  Builder builder_;
  bool ready_ = false;
  std::map<proto::TileAddress, const proto::WorkTask*> below_;
  std::map<std::string, Problem> changed_;  ///< rasters, by path
  std::set<std::string> examined_;          ///< by path and options
};

/// A raster in object storage that was read when the plan was made, and now is not there or ends early: who asks again may get
/// it.
Problem of_storage(const proto::WorkPlan& plan, const proto::WorkTask& task, Problem problem) {
  for (const raster::MosaicMember& member : members_of(plan, task)) {
    if (problem.type.starts_with("raster-") && raster::is_remote(member.path)) problem.type = "storage-read";
  }
  return problem;
}

enum class Order { as_given, dearest_first };

/// Hands out tasks, each once.
class TaskList {
 public:
  TaskList(const proto::WorkStage& stage, std::vector<std::size_t> tasks, Order order, std::size_t begin)
      : stage_(stage), tasks_(std::move(tasks)) {
    if (order == Order::dearest_first) {
      std::stable_sort(tasks_.begin(), tasks_.end(),
                       [&](std::size_t a, std::size_t b) { return cost_of(task(a)) > cost_of(task(b)); });
    }
    if (!tasks_.empty())
      std::rotate(tasks_.begin(), tasks_.begin() + static_cast<std::ptrdiff_t>(begin % tasks_.size()), tasks_.end());
  }
  /// Null where none is left.
  const proto::WorkTask* next() {
    const std::size_t k = next_++;
    return k < tasks_.size() ? &task(tasks_[k]) : nullptr;
  }
  void end() { next_ = tasks_.size(); }

 private:
  const proto::WorkTask& task(std::size_t k) const { return stage_.tasks(static_cast<int>(k)); }
  const proto::WorkStage& stage_;
  std::vector<std::size_t> tasks_;
  std::atomic<std::size_t> next_{0};
};

/// Tasks that will fail again, while others go on.
class Failures {
 public:
  /// The problem is the caller's where others would have it, too.
  proto::Result<TaskOutcome> take(const Problem& problem) {
    if (worth_retrying(problem)) return problem;
    const std::lock_guard lock(mutex_);
    if (++tasks_ == 1) first_ = problem;
    if (told_.insert(problem.detail).second && told_.size() <= kMostNamed)
      named_ += (named_.empty() ? "" : "; ") + problem.detail;
    return TaskOutcome::failed;
  }
  /// Of all; that of the only one as it was.
  proto::Result<void> sum() const {
    if (tasks_ == 0) return {};
    if (tasks_ == 1) return first_;
    return Problem{"tasks-failed",
                   std::to_string(tasks_) + " tasks have failed, and the others are done: " + named_ +
                       (told_.size() > kMostNamed ? "; …, " + std::to_string(told_.size()) + " reasons in all" : ""),
                   first_.accepted, first_.parameter};
  }

 private:
  static constexpr std::size_t kMostNamed = 5;
  std::mutex mutex_;
  std::size_t tasks_ = 0;
  Problem first_;
  std::string named_;
  std::set<std::string> told_;  ///< one raster is read by many tasks
};

proto::Result<TaskOutcome> do_task(Worker& worker, const proto::WorkPlan& plan, const proto::WorkTask& task,
                                   const std::string& folder, Failures& failures) {
  if (read_shard(folder, task).ok()) return TaskOutcome::was_done;
  if (const auto ready = worker.prepare(); !ready.ok()) return ready.problem();
  const auto finished = worker.work(task);
  if (!finished.ok()) {
    if (const auto usable = worker.opened(); !usable.ok()) return usable.problem();
    if (task.sources_size() == 0) return finished.problem();  // no raster's
    return failures.take(of_storage(plan, task, finished.problem()));
  }
  if (const auto written = write_shard(folder, task, *finished); !written.ok()) return written.problem();
  return TaskOutcome::done;
}

/// A worker a device. The first problem, by the devices' order, or an exception ends the list for all.
proto::Result<void> side_by_side(std::size_t devices, TaskList& list,
                                 const std::function<proto::Result<void>(std::size_t)>& work_on) {
  std::vector<proto::Result<void>> results(devices);
  Workers(static_cast<unsigned>(devices)).each(devices, [&](std::size_t device, unsigned) {
    try {
      results[device] = work_on(device);
    } catch (...) {
      list.end();
      throw;
    }
    if (!results[device].ok()) list.end();
  });
  for (const auto& result : results)
    if (!result.ok()) return result;
  return {};
}

}  // namespace

double cost_of(const proto::WorkTask& task) { return std::max(1.0, task.sources_size() > 0 ? task.samples() : task.cost()); }

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
  TaskList list(stage, tasks, order.devices.size() > 1 ? Order::dearest_first : Order::as_given, order.begin);
  Failures failures;
  std::mutex telling;
  const auto work_on = [&](std::size_t device) -> proto::Result<void> {
    Worker worker(plan, stage, order, device, stop);
    while (const proto::WorkTask* task = list.next()) {
      if (stop) return kCancelled;
      const auto outcome = do_task(worker, plan, *task, order.folder, failures);
      if (!outcome) return outcome.problem();
      const std::lock_guard lock(telling);
      ended(*task, *outcome);
    }
    return {};
  };
  const auto ended_by = order.devices.size() == 1 ? work_on(0) : side_by_side(order.devices.size(), list, work_on);
  return ended_by.ok() ? failures.sum() : ended_by;
}

bool worth_retrying(const proto::Problem& problem) {
  for (const char* type : {"storage-read", "storage-write", "storage-full", "store-write", "export-write", "shard-missing",
                           "shards-missing", "shard-damaged", "cancelled"}) {
    if (problem.type == type) return true;
  }
  return false;
}

}  // namespace cordillera::pipeline::work
