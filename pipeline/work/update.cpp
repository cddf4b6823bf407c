#include "pipeline/work/update.h"

#include <map>

#include "pipeline/build/stages.h"
#include "pipeline/build/teller.h"
#include "pipeline/plan/plan.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/work_plan.h"
#include "proto/version.h"

namespace cordillera::pipeline::work {
namespace {

using Keys = std::map<proto::TileAddress, std::string>;

Keys keys_of(const proto::WorkPlan& plan) {
  Keys keys;
  for (const proto::WorkStage& stage : plan.stages()) {
    for (const proto::WorkTask& task : stage.tasks()) keys[address_of(task)] = task.key();
  }
  return keys;
}

Revision between(const proto::WorkPlan& before, const proto::WorkPlan& now) {
  const Keys old = keys_of(before), wanted = keys_of(now);
  Revision revision;
  revision.block_level = static_cast<int>(now.plan().block_level());
  revision.finest_level = static_cast<int>(now.plan().finest_level());
  revision.merged_at_once = merged_at_once(now.plan());
  for (const auto& [node, key] : old) {
    const auto found = wanted.find(node);
    const bool same = found != wanted.end() && found->second == key;
    (same ? revision.finished : revision.stale).push_back(node);
  }
  return revision;
}

/// An unfinished store of this very plan goes on; else one is made of the version before.
proto::Result<void> prepare_store(const UpdateOrder& order, const std::optional<proto::WorkPlan>& before,
                                  const proto::WorkPlan& plan) {
  const std::string tasks = plan.SerializeAsString(), &path = order.request.store_path;
  if (note_in(path, kTasksNote) == tasks) return {};
  if (before && merged_at_once(before->plan()) == merged_at_once(plan.plan())) {
    if (const auto revised = revise_store(order.before, path, plan.plan(), between(*before, plan)); !revised.ok()) return revised;
  }
  std::vector<Note> notes = order.notes;
  notes.push_back({kTasksNote, tasks});
  return begin_store(path, plan.plan(), notes);
}

/// Where no raster lies there is no task.
Stages stages_of(const proto::WorkPlan& plan) {
  Stages stages;
  for (const proto::WorkStage& stage : plan.stages()) {
    stages.emplace_back();
    for (const proto::WorkTask& task : stage.tasks()) stages.back().push_back(address_of(task));
  }
  return stages;
}

}  // namespace

std::optional<proto::WorkPlan> plan_in(const std::string& store_path) {
  const auto bytes = note_in(store_path, kTasksNote);
  proto::WorkPlan plan;
  if (!bytes || !plan.ParseFromString(*bytes) || plan.stages_size() == 0) return std::nullopt;
  if (plan.format() != kPlanFormat || plan.plan().program() != proto::kProgram) return std::nullopt;
  return plan;
}

proto::Result<std::int64_t> first_block_samples(const BuildRequest& request, const raster::Source& source) {
  const auto range = level_range(source.description(), request.options);
  if (!range.ok()) return range.problem();
  const raster::Source::Window w = source.window({range->first});
  return samples_a_block((w.east - w.west + 1) * (w.north - w.south + 1), kUpdateBlocks, kSmallExactSamples);
}

proto::Result<proto::Manifest> update(const UpdateOrder& order, const ProgressCallback& progress, const std::atomic<bool>& stop) {
  Teller teller(progress);
  teller.stage("plan", 1);
  const BuildRequest& request = order.request;
  const auto before = order.before.empty() ? std::nullopt : plan_in(order.before);
  const auto plan = plan_work(request, stop, {before ? &*before : nullptr, 0, kUpdateBlocks, order.least_block_samples});
  if (!plan.ok()) return plan.problem();
  if (const auto ready = prepare_store(order, before, *plan); !ready.ok()) return ready.problem();
  auto store = StoreWriter::open(request.store_path, plan->plan(), Existing::refuse);  // what was prepared is not to be lost
  if (!store.ok()) return store.problem();
  Workshop shop(request, plan->plan(), stop);
  if (const auto ready = shop.builder.prepare(); !ready.ok()) return ready.problem();
  const Site site{plan->plan(), shop, **store, teller, request.follower, Consumed::kept, stop};
  if (const auto made = make_stages(site, stages_of(*plan)); !made.ok()) return made.problem();
  auto published = publish_store(**store, request, *plan);
  if (published.ok()) teller.tell(1);
  return published;
}

}  // namespace cordillera::pipeline::work
