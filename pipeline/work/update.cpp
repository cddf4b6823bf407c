#include "pipeline/work/update.h"

#include <map>

#include "pipeline/build/block_order.h"
#include "pipeline/build/builder.h"
#include "pipeline/build/in_flight.h"
#include "pipeline/build/teller.h"
#include "pipeline/build/water_build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/work.h"
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

struct Site {
  const proto::WorkPlan& plan;
  StoreWriter& store;
  Builder& builder;
  unsigned threads;
  Teller& teller;
  const std::atomic<bool>& stop;
  BlockFollower* follower;
};

/// Tasks of a stage that are still to be done.
std::vector<const proto::WorkTask*> open_tasks(const Site& site, const proto::WorkStage& stage) {
  std::vector<const proto::WorkTask*> open;
  for (const proto::WorkTask& task : stage.tasks()) {
    if (!site.store.finished(address_of(task))) open.push_back(&task);
  }
  return open;
}

proto::Result<void> do_stage(const Site& site, const std::vector<const proto::WorkTask*>& tasks) {
  double done = 0;
  const auto is_block = [&](std::size_t k) { return tasks[k]->sources_size() > 0; };
  std::vector<proto::TileAddress> nodes;
  for (const proto::WorkTask* task : tasks) nodes.push_back(address_of(*task));
  BlockOrder order(nodes, is_block(0) ? site.follower : nullptr);
  const auto make = [&](std::size_t) -> proto::Result<FinishedTask> {
    if (site.stop) return kCancelled;
    const std::size_t k = order.next();
    const proto::TileAddress& node = nodes[k];
    if (is_block(k)) return site.builder.block(node, [](double) {});
    return site.builder.merge(node, [&](const proto::TileAddress& child) { return site.store.mesh(child); });
  };
  // A merge is one tile: as many side by side as there are threads.
  const std::size_t at_once = is_block(0) ? site.builder.tasks_at_once() : site.threads;
  return in_flight(tasks.size(), at_once, make, [&](std::size_t k, FinishedTask&& task) {
    task.consumed.clear();  // the next version may need them
    auto committed = site.store.commit(task);
    if (committed.ok() && is_block(k)) site.teller.committed_block();
    if (committed.ok()) site.teller.tell(done += is_block(k) ? tasks[k]->samples() : 1);
    task.mesh.reset();  // a follower shows tiles
    if (committed.ok() && is_block(k) && site.follower) site.follower->take(std::move(task));
    return committed;
  });
}

proto::Result<void> do_all(const Site& site) {
  for (int s = 0; s < site.plan.stages_size(); ++s) {
    const auto tasks = open_tasks(site, site.plan.stages(s));
    double total = 0;
    for (const proto::WorkTask* task : tasks) total += s == 0 ? task->samples() : 1;
    if (tasks.empty()) continue;
    site.teller.stage(s == 0 ? "build" : "merge", total);
    const Followed followed(s == 0 ? site.follower : nullptr, site.plan.plan(), site.teller);
    if (const auto stage = do_stage(site, tasks); !stage.ok()) return stage;
  }
  return {};
}

}  // namespace

std::optional<proto::WorkPlan> plan_in(const std::string& store_path) {
  const auto bytes = note_in(store_path, kTasksNote);
  proto::WorkPlan plan;
  if (!bytes || !plan.ParseFromString(*bytes) || plan.stages_size() == 0) return std::nullopt;
  if (plan.format() != kPlanFormat || plan.plan().program() != proto::kProgram) return std::nullopt;
  return plan;
}

raster::MosaicMember member_of(const proto::PlannedSource& source, const std::string& path, raster::Trust trust) {
  const auto side = [&](int k) { return static_cast<std::int64_t>(source.window(k)); };
  return {path,
          source.spec().name(),
          trust,
          source.spec().options(),
          source.description(),
          {side(0), side(1), side(2), side(3)},
          source.state(),
          source.datum()};
}

proto::Result<std::int64_t> first_block_samples(const BuildRequest& request, const raster::Source& source) {
  const auto range = level_range(source.description(), request.options);
  if (!range.ok()) return range.problem();
  const raster::Source::Window w = source.window({range->first});
  return samples_a_block((w.east - w.west + 1) * (w.north - w.south + 1), kUpdateBlocks);
}

proto::Result<proto::Manifest> update(const UpdateOrder& order, const ProgressCallback& progress, const std::atomic<bool>& stop) {
  Teller teller(progress);
  teller.stage("plan", 1);
  const BuildRequest& request = order.request;
  const auto before = order.before.empty() ? std::nullopt : plan_in(order.before);
  const auto plan = plan_work(request, stop, {before ? &*before : nullptr, 0, kUpdateBlocks});
  if (!plan.ok()) return plan.problem();
  if (const auto ready = prepare_store(order, before, *plan); !ready.ok()) return ready.problem();
  auto store = StoreWriter::open(request.store_path, plan->plan(), Existing::refuse);  // what was prepared is not to be lost
  if (!store.ok()) return store.problem();
  Workers workers(request.options.threads());
  Builder builder(
      plan->plan(), workers, [&] { return open_source(request); }, {request.options.device(), request.options.memory()}, stop);
  if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
  if (const auto done = do_all({*plan, **store, builder, workers.threads(), teller, stop, request.follower}); !done.ok())
    return done.problem();
  teller.stage("publish", 1);
  if (const auto masked = build_water(
          plan->plan(), workers, [&] { return open_source(request); }, **store, stop);
      !masked.ok())
    return masked.problem();
  auto published = publish_store(**store, request, *plan);
  if (published.ok()) teller.tell(1);
  return published;
}

}  // namespace cordillera::pipeline::work
