#include "pipeline/work/update.h"

#include <algorithm>
#include <map>

#include "pipeline/build/stages.h"
#include "pipeline/plan/plan.h"
#include "pipeline/progress/teller.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/work_plan.h"
#include "proto/version.h"

namespace cordillera::pipeline::work {
namespace {

/// The ground of a version, as its tiles tell it: whether a raster that lies beside a block can change it all the same, by
/// closing a void that is filled then.
class WholeGround {
 public:
  WholeGround(const StoreReader& store, const proto::Plan& before, const proto::Plan& now)
      : store_(store), lattice_{static_cast<int>(before.finest_level())} {
    const auto& w = before.window();
    const bool stays = std::equal(w.begin(), w.end(), now.window().begin(), now.window().end());
    // Beside the data is no void. Not where data comes there, nor, for simplicity, where a window goes around the earth.
    if (stays && w[0] >= 0 && w[2] <= lattice_.columns()) window_ = {w[0], w[1], w[2], w[3]};
  }

  /// Whether there is no void in a block, nor within a tile of it: farther than any sample that it looks at.
  bool around(const proto::TileAddress& block) const {
    const int level = lattice_.finest_level;
    const std::int32_t tiles = std::int32_t{1} << (level - block.z);
    const std::int32_t west = block.x * tiles - 1, south = block.y * tiles - 1, east = west + tiles + 1,
                       north = south + tiles + 1;
    if (west < 0 || south < 0 || east >= proto::tiles_across(level) || north >= proto::tiles_up(level)) return false;
    std::int64_t missing = 0;
    for (std::int32_t y = south; y <= north; ++y) {
      for (std::int32_t x = west; x <= east; ++x) missing += samples_in({level, x, y});
    }
    for (const proto::TileRecord& tile : store_.records(level, west, south, east, north))
      missing -= std::int64_t{tile.valid_samples()} - tile.filled_samples();
    return missing == 0;
  }

 private:
  /// With its western and southern side, as records count them.
  std::int64_t samples_in(const proto::TileAddress& tile) const {
    const std::int64_t west = lattice_.west(tile), south = lattice_.south(tile);
    const auto common = [](std::int64_t from, std::int64_t low, std::int64_t high) {
      return std::max<std::int64_t>(std::min(from + proto::kTileCells, high + 1) - std::max(from, low), 0);
    };
    return common(west, window_.west, window_.east) * common(south, window_.south, window_.north);
  }
  const StoreReader& store_;
  const proto::Lattice lattice_;
  raster::Source::Window window_{0, 0, lattice_.columns(), lattice_.rows()};
};

using Tasks = std::map<proto::TileAddress, const proto::WorkTask*>;

Tasks tasks_of(const proto::WorkPlan& plan) {
  Tasks tasks;
  for (const proto::WorkStage& stage : plan.stages()) {
    for (const proto::WorkTask& task : stage.tasks()) tasks[address_of(task)] = &task;
  }
  return tasks;
}

const std::string& near_key_of(const proto::WorkTask& task) { return task.near_key().empty() ? task.key() : task.near_key(); }

Revision between(const proto::WorkPlan& before, const proto::WorkPlan& now, const WholeGround& ground) {
  const Tasks old = tasks_of(before), wanted = tasks_of(now);
  Revision revision;
  revision.block_level = static_cast<int>(now.plan().block_level());
  revision.finest_level = static_cast<int>(now.plan().finest_level());
  const auto same = [&](const proto::WorkTask& a, const proto::WorkTask& b) {
    if (a.key() == b.key()) return true;
    const bool is_block = static_cast<int>(a.level()) == revision.block_level && a.samples() > 0;
    return is_block && near_key_of(a) == near_key_of(b) && ground.around(address_of(a));
  };
  for (const auto& [node, task] : old) {
    const auto found = wanted.find(node);
    const bool stays = found != wanted.end() && same(*task, *found->second);
    (stays ? revision.finished : revision.stale).push_back(node);
  }
  return revision;
}

/// An unfinished store of this very plan goes on; else one is made of the version before.
proto::Result<void> prepare_store(const UpdateOrder& order, const std::optional<proto::WorkPlan>& before,
                                  const proto::WorkPlan& plan) {
  const std::string tasks = plan.SerializeAsString(), &path = order.request.store_path;
  if (note_in(path, kTasksNote) == tasks) return {};
  if (before && has_levels_above(before->plan()) == has_levels_above(plan.plan())) {
    const auto store = StoreReader::open(order.before);
    if (!store.ok()) return store.problem();
    const Revision revision = between(*before, plan, {**store, before->plan(), plan.plan()});
    if (const auto revised = revise_store(order.before, path, plan.plan(), revision); !revised.ok()) return revised;
  }
  std::vector<Note> notes = order.notes;
  notes.push_back({kTasksNote, tasks});
  return begin_store(path, plan.plan(), notes);
}

/// Numbers stay, and whether there is water is one of them: what the first version made of its rasters. Rasters that cannot be
/// opened any more have no note; all was made of them.
BuildRequest with_sea_noted(BuildRequest request, const proto::Plan& plan) {
  const auto source = open_source(request);
  if (source.ok() && shows_sea(plan, request.options, **source))
    request.options.add_warnings(
        "still water of exactly 0 m is land here, for the first version had none to take for the sea: a dataset that is posted "
        "anew with water=0 takes it for that");
  return request;
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
  if (plan.format() != kPlanFormat || !plan.plan().exact() || plan.plan().program() != proto::kProgram) return std::nullopt;
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
  const bool may_lack_sea = before && !plan->plan().options().has_water();
  auto published = publish_store(**store, may_lack_sea ? with_sea_noted(request, plan->plan()) : request, *plan);
  if (published.ok()) teller.tell(1);
  return published;
}

}  // namespace cordillera::pipeline::work
