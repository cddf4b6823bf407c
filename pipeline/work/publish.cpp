#include "pipeline/work/publish.h"

#include <cerrno>
#include <cstring>
#include <set>
#include <vector>

#include "pipeline/build/blank_manifest.h"
#include "pipeline/build/in_flight.h"
#include "pipeline/build/water_build.h"
#include "pipeline/store/mesh_files.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/work/shard.h"
#include "pipeline/work/work_plan.h"
#include "raster/disk/write_all.h"
#include "raster/storage/storage.h"

namespace cordillera::pipeline::work {
namespace {

constexpr std::size_t kMostNamed = 5;  // in a message

/// In object storage a shard is a few requests, whose answers take longer than to commit it.
constexpr std::size_t kReadAtOnce = 16;

proto::Result<void> all_there(const proto::WorkPlan& plan, const std::string& folder) {
  const auto there = shards_there(folder, Shards::done);
  if (!there) return there.problem();
  std::size_t missing = 0;
  std::string named;
  for (int s = 0; s < plan.stages_size(); ++s) {
    const proto::WorkStage& stage = plan.stages(s);
    for (int k = 0; k < stage.tasks_size(); ++k) {
      if (there->contains(shard_path(folder, stage.tasks(k).key()))) continue;
      if (++missing > kMostNamed) continue;
      named += (named.empty() ? "" : ", ") + std::string("stage ") + std::to_string(s) + " task " + std::to_string(k);
    }
  }
  if (missing == 0) return {};
  return proto::Problem{"shards-missing",
                        (missing == 1 ? "1 task has" : std::to_string(missing) + " tasks have") + " not been done: " + named +
                            (missing > kMostNamed ? ", …" : ""),
                        "cordillera work for what is missing", ""};
}

proto::Result<proto::Manifest> collect(const proto::WorkPlan& plan, const std::string& folder, const std::string& path,
                                       const std::atomic<bool>& stop) {
  auto store = StoreWriter::open(path, plan.plan());
  if (!store.ok()) return store.problem();
  std::vector<const proto::WorkTask*> tasks;
  for (const proto::WorkStage& stage : plan.stages())
    for (const proto::WorkTask& task : stage.tasks()) tasks.push_back(&task);
  const auto read = [&](std::size_t k) {
    return stop ? proto::Result<FinishedTask>(kCancelled) : read_shard_tiles(folder, *tasks[k]);
  };
  const auto commit = [&](std::size_t, FinishedTask&& task) { return (*store)->commit(task); };
  if (const auto all = in_flight(
          tasks.size(), [] { return kReadAtOnce; }, read, commit);
      !all.ok())
    return all.problem();
  if (const auto masked = build_water_above(plan.plan(), **store, stop); !masked.ok()) return masked.problem();
  return publish_store(**store, request_of(plan), plan);
}

}  // namespace

proto::Result<std::vector<Progress>> progress_of(const proto::WorkPlan& plan, const std::string& folder) {
  const auto there = shards_there(folder, Shards::done);
  if (!there) return there.problem();
  std::vector<Progress> stages;
  for (const proto::WorkStage& stage : plan.stages()) {
    Progress progress{0, static_cast<std::size_t>(stage.tasks_size())};
    for (const proto::WorkTask& task : stage.tasks()) progress.done += there->contains(shard_path(folder, task.key())) ? 1 : 0;
    stages.push_back(progress);
  }
  return stages;
}

proto::Result<proto::Manifest> publish_store(StoreWriter& store, const BuildRequest& request, const proto::WorkPlan& plan) {
  proto::Manifest manifest = blank_manifest(request, plan.plan(), plan.source(), {0, "tasks"});
  manifest.set_device("tasks");
  auto published = store.publish(std::move(manifest));
  if (!published.ok() && published.problem().type == "no-data") return without_data(request);
  return published;
}

proto::Result<proto::Manifest> publish(const proto::WorkPlan& plan, const std::string& folder, const std::string& store_path,
                                       const std::atomic<bool>& stop) {
  if (const auto there = all_there(plan, folder); !there.ok()) return there.problem();
  const std::string part = store_path + ".publishing";
  const auto clean = [&] { remove_store(part); };
  clean();
  auto manifest = collect(plan, folder, part, stop);
  if (!manifest.ok()) {
    clean();
    return manifest;
  }
  remove_logs(store_path);  // an unfinished build's, which would be played into the new file
  // On disk for good: shards may be removed then.
  if (!raster::put_in_place(part, store_path))
    return proto::Problem{"storage-write", store_path + " cannot be written: " + std::strerror(errno),
                          "a folder that can be written", ""};
  return manifest;
}

proto::Result<std::size_t> prune(const proto::WorkPlan& plan, const std::string& folder) {
  std::set<std::string> wanted;
  for (const proto::WorkStage& stage : plan.stages()) {
    for (const proto::WorkTask& task : stage.tasks()) wanted.insert(shard_path(folder, task.key()));
  }
  std::size_t removed = 0;
  const auto there = shards_there(folder, Shards::all);
  if (!there) return there.problem();
  for (const std::string& path : *there) {
    if (!wanted.contains(path) && raster::remove_file(path)) ++removed;
  }
  return removed;
}

}  // namespace cordillera::pipeline::work
