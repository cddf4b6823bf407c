#include "pipeline/work/work_plan.h"

#include <algorithm>
#include <set>

#include "gpu/exact/side_chain.h"
#include "pipeline/build/pilot.h"
#include "pipeline/build/stages.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tileset/manifest_json.h"
#include "pipeline/work/task_keys.h"
#include "proto/mesh.h"
#include "proto/version.h"
#include "raster/mosaic/window_index.h"
#include "raster/open/raster_state.h"
#include "raster/sample/back_projection.h"
#include "raster/storage/storage.h"
#include "raster/voids/filled_source.h"

namespace cordillera::pipeline::work {
namespace {

using proto::TileAddress;

proto::PlannedSource planned(const raster::MosaicMember& member) {
  proto::PlannedSource source;
  source.mutable_spec()->set_path(member.path);
  source.mutable_spec()->set_name(member.name);
  *source.mutable_spec()->mutable_options() = reading(member.options);
  *source.mutable_description() = member.description;
  for (const std::int64_t side : {member.window.west, member.window.south, member.window.east, member.window.north}) {
    source.add_window(static_cast<double>(side));
  }
  source.set_state(member.state);
  source.set_datum(member.datum);
  const raster::PixelGrid& grid = member.grid;
  for (const double number : {grid.x, grid.y, grid.step_x, grid.step_y, grid.turn}) source.add_grid(number);
  return source;
}

raster::MosaicMember member_of(const proto::PlannedSource& source) {
  return work::member_of(source, source.spec().path(), raster::Trust::operator_file);
}

raster::Source::Window wider(const raster::Source::Window& w, std::int64_t by) {
  return {w.west - by, w.south - by, w.east + by, w.north + by};
}

proto::WorkTask task_at(const TileAddress& node) {
  proto::WorkTask task;
  task.set_level(static_cast<std::uint32_t>(node.z));
  task.set_x(static_cast<std::uint32_t>(node.x));
  task.set_y(static_cast<std::uint32_t>(node.y));
  return task;
}

/// Which rasters a block may depend on.
class BlockSources {
 public:
  explicit BlockSources(const proto::WorkPlan& work) : lattice_(lattice_of(work.plan())), rasters_(windows(work), lattice_) {}

  /// Those that touch a window, in order. Where it has a pole, those around that, too: it is one point, with the height that the
  /// first of them has.
  std::vector<std::uint32_t> of(const raster::Source::Window& read) const {
    const auto touched = rasters_.touching(read);
    std::set<std::uint32_t> sources(touched.begin(), touched.end());
    for (const std::int64_t pole : {std::int64_t{0}, lattice_.rows()}) {
      if (sources.empty() || pole < read.south || pole > read.north) continue;
      const auto around = rasters_.touching({0, pole, lattice_.columns() - 1, pole});
      sources.insert(around.begin(), around.end());
    }
    return {sources.begin(), sources.end()};
  }

 private:
  static std::vector<raster::Source::Window> windows(const proto::WorkPlan& work) {
    const proto::Lattice lattice = lattice_of(work.plan());
    std::vector<raster::Source::Window> windows;
    for (const proto::PlannedSource& source : work.sources()) {
      const raster::Source::Window own = raster::coarser(member_of(source).window, lattice);
      windows.push_back(wider(own, work.sources_size() > 1 ? raster::reach_beyond(source.description(), lattice) : 0));
    }
    return windows;
  }
  const proto::Lattice lattice_;
  const raster::WindowIndex rasters_;
};

/// Blocks that some raster may touch, with the rasters; what none touches has no data and is no task.
Keys add_blocks(const TaskKeys& names, proto::WorkPlan& work) {
  const proto::Plan& plan = work.plan();
  const proto::Lattice lattice = lattice_of(plan);
  const int level = static_cast<int>(plan.block_level());
  // One raster alone has no seam, and a block of it no other source.
  const bool several = work.sources_size() > 1;
  const std::int64_t seam =
      raster::feather_vertices(work.options().feather(), lattice) + (pixels_within_m(plan) > 0 ? raster::kProjectionReach : 0);
  // As much as a block reads of its neighbours, or more.
  const std::int64_t reach = std::max<std::int64_t>(gpu::exact::kSideReach, 2 * lattice.cell_units(level));
  const std::int64_t near = reach + (several ? seam : 0);
  const std::int64_t far = near + (several ? raster::fill_reach(raster::fill_limit_cells(work.options())) : 0);
  const BlockSources rasters(work);
  Keys keys;
  proto::WorkStage* stage = work.add_stages();
  for (const TileAddress& node : touched_tiles(plan, level)) {
    const raster::Source::Window window = node_window(plan, node, reach);
    if (window.west > window.east || window.south > window.north) continue;
    const std::vector<std::uint32_t> sources = rasters.of(wider(window, far)), beside = rasters.of(wider(window, near));
    if (sources.empty()) continue;
    proto::WorkTask task = task_at(node);
    task.mutable_sources()->Add(sources.begin(), sources.end());
    task.set_samples(static_cast<double>(window.east - window.west + 1) * static_cast<double>(window.north - window.south + 1));
    task.set_key(names.block(node, window, sources));
    if (beside.size() < sources.size()) task.set_near_key(names.block(node, window, beside));
    keys[node] = task.key();
    *stage->add_tasks() = task;
  }
  return keys;
}

/// What the levels above blocks cost, in samples that a block reads: an eighth of the blocks' for the first, and a quarter of it
/// from each level to the next.
constexpr double kShareOfAbove = 1.0 / 6;

void add_merge(const TaskKeys& names, const Keys& below, proto::WorkPlan& work) {
  if (!has_levels_above(work.plan())) return;
  proto::WorkTask task = task_at(node_above(work.plan()));
  task.set_key(names.above(below));
  double samples = 0;
  for (const proto::WorkTask& block : work.stages(0).tasks()) samples += block.samples();
  task.set_cost(samples * kShareOfAbove);
  *work.add_stages()->add_tasks() = task;
}

/// Blocks of the size that is asked for, and what follows from it.
void set_blocks(const PlanGiven& given, proto::Plan& plan) {
  const std::int64_t samples = columns_of(plan) * rows_of(plan);
  if (given.block_samples > 0)
    use_smaller_blocks(plan, std::max(given.block_samples, kLeastBlockSamples));
  else if (given.blocks > 0)
    use_smaller_blocks(plan, samples_a_block(samples, given.blocks, given.least_block_samples));
}

/// The numbers of an earlier plan where its rasters lie now. Where that is farther apart, coarse levels are rounded in another
/// way.
proto::Result<proto::Plan> plan_again(const BuildRequest& request, raster::Source& source, const proto::Plan& before) {
  proto::Plan plan = before;
  const raster::Source::Window window = source.window(lattice_of(plan));
  if (window.west > window.east || window.south > window.north) return without_data(request);
  plan.clear_window();
  for (const std::int64_t side : {window.west, window.south, window.east, window.north})
    plan.add_window(static_cast<std::int32_t>(side));
  for (proto::LevelPlan& numbers : *plan.mutable_levels()) derive_level(plan, numbers);
  plan.set_program(proto::kProgram);
  plan.set_source_state(state_of(request));
  return plan;
}

/// All numbers: worked out, or those of an earlier plan.
proto::Result<proto::Plan> numbers_of(const BuildRequest& request, raster::Source& source, const PlanGiven& given,
                                      const std::atomic<bool>& stop) {
  if (given.before != nullptr) return plan_again(request, source, given.before->plan());
  auto plan = plan_of(request, source);
  if (!plan.ok()) return plan;
  set_blocks(given, *plan);
  if (request.options.keep_size() == 0) return plan;
  Workshop shop(request, *plan, stop);
  if (const auto ready = shop.builder.prepare(); !ready.ok()) return ready.problem();
  if (const auto piloted = run_pilot(shop.builder, *plan, stop); !piloted.ok()) return piloted.problem();
  return plan;
}

bool have_one_size(const std::vector<raster::MosaicMember>& members) {
  const proto::Source& first = members.front().description;
  return std::all_of(members.begin(), members.end(), [&](const raster::MosaicMember& member) {
    return member.description.columns() == first.columns() && member.description.rows() == first.rows();
  });
}

proto::Problem unreadable(const std::string& path, const std::string& why) {
  return {"plan-invalid", path + " " + why, "a folder that `cordillera plan` wrote", ""};
}

proto::Problem another_state(const raster::MosaicMember& planned, const std::string& now) {
  return {"source-changed",
          planned.path + " is not what it was when the plan was made (then " + raster::told_state(planned.state) + ", now " +
              (now.empty() ? "not there" : raster::told_state(now)) + ")",
          "the same files as planned, or a new plan", ""};
}

}  // namespace

raster::MosaicMember member_of(const proto::PlannedSource& source, const std::string& path, raster::Trust trust) {
  const auto side = [&](int k) { return static_cast<std::int64_t>(source.window(k)); };
  return {path,
          source.spec().name(),
          trust,
          source.spec().options(),
          source.description(),
          {side(0), side(1), side(2), side(3)},
          source.state(),
          source.datum(),
          source.grid_size() == 5
              ? raster::PixelGrid{source.grid(0), source.grid(1), source.grid(2), source.grid(3), source.grid(4)}
              : raster::PixelGrid{}};
}

proto::BuildOptions reading(const proto::BuildOptions& options) {
  proto::BuildOptions out;
  out.set_band(options.band());
  out.set_crs(options.crs());
  out.set_vertical_datum(options.vertical_datum());
  out.set_nodata(options.nodata());
  out.set_voids(options.voids());
  if (options.has_z_scale()) out.set_z_scale(options.z_scale());
  if (options.has_z_offset()) out.set_z_offset(options.z_offset());
  *out.mutable_bbox() = options.bbox();
  return out;
}

proto::Result<proto::WorkPlan> plan_work(const BuildRequest& request, const std::atomic<bool>& stop, const PlanGiven& given) {
  const auto source = open_source(request);
  if (!source.ok()) return source.problem();
  const auto plan = numbers_of(request, **source, given, stop);
  if (!plan.ok()) return plan.problem();
  proto::WorkPlan work;
  work.set_format(kPlanFormat);
  *work.mutable_plan() = *plan;
  *work.mutable_options() = request.options;
  work.set_name(request.raster_name);
  for (const raster::MosaicMember& member : request.members) *work.add_sources() = planned(member);
  *work.mutable_source() = (*source)->description();
  if (!have_one_size(request.members)) {
    work.mutable_source()->clear_columns();
    work.mutable_source()->clear_rows();
  }
  if (const std::string& mask = request.options.water_mask(); !mask.empty())
    work.set_water_mask_state(raster::state_of_raster(mask, raster::Trust::operator_file));
  const TaskKeys names(work);
  add_merge(names, add_blocks(names, work), work);
  if (work.stages(0).tasks_size() == 0) return without_data(request);
  return work;
}

proto::Result<void> write_plan(const proto::WorkPlan& plan, const std::string& folder) {
  const std::string json = compact_json(plan);
  if (json.empty()) return unreadable(folder, "cannot be written as JSON: a name is not UTF-8");
  return raster::write_whole(folder + "/" + kPlanFile, json + "\n");
}

proto::Result<proto::WorkPlan> read_plan(const std::string& folder) {
  const std::string path = folder + "/" + kPlanFile;
  const auto json = raster::read_whole(path);
  if (!json.ok()) return json.problem();
  if (!*json) return unreadable(path, "does not exist");
  proto::WorkPlan plan;
  if (!parse_json(**json, &plan) || !plan.has_plan() || plan.stages_size() == 0) { return unreadable(path, "is no plan"); }
  if (plan.format() != kPlanFormat) {
    return proto::Problem{"plan-version",
                          path + " has format " + std::to_string(plan.format()) + "; this program makes and takes format " +
                              std::to_string(kPlanFormat),
                          "a new plan", ""};
  }
  if (!plan.plan().exact() || plan.stages_size() > 2)
    return proto::Problem{"plan-version", path + " has tasks of an earlier version, which this program makes no more",
                          "a new plan", ""};
  if (plan.plan().program() != proto::kProgram) {
    return proto::Problem{"plan-version", path + " was made by " + plan.plan().program() + "; this is " + proto::kProgram,
                          "the same version on every machine, or a new plan", ""};
  }
  return plan;
}

BuildRequest request_of(const proto::WorkPlan& plan) {
  BuildRequest request;
  request.raster_name = plan.name();
  request.id = plan.name().substr(0, plan.name().rfind('.'));
  request.options = plan.options();
  for (const proto::PlannedSource& source : plan.sources()) request.members.push_back(member_of(source));
  return request;
}

std::vector<raster::MosaicMember> members_of(const proto::WorkPlan& plan, const proto::WorkTask& task) {
  std::vector<raster::MosaicMember> members;
  for (const std::uint32_t k : task.sources()) members.push_back(member_of(plan.sources(static_cast<int>(k))));
  return members;
}

std::optional<raster::MosaicMember> water_mask_of(const proto::WorkPlan& plan) {
  const std::string& path = plan.options().water_mask();
  if (path.empty()) return std::nullopt;
  raster::MosaicMember mask;
  mask.path = mask.name = path;
  mask.state = plan.water_mask_state();
  return mask;
}

proto::Result<void> check_unchanged(const raster::MosaicMember& planned) {
  const auto now = raster::examine(planned.path, planned.name, planned.trust, planned.options);
  if (!now.ok()) {
    proto::Problem problem = now.problem();
    // Of many rasters on many machines a name alone says too little.
    if (problem.detail.find(planned.path) == std::string::npos) problem.detail = planned.path + ": " + problem.detail;
    return problem;
  }
  if (now->state != planned.state) return another_state(planned, now->state);
  if (now->datum != planned.datum) {
    return proto::Problem{"source-changed",
                          "the geoid grid for " + planned.path + " differs from the plan's (undulations " + now->datum +
                              ", planned " + planned.datum + ")",
                          "the same grid files on every machine, or a new plan", ""};
  }
  return {};
}

proto::Result<void> check_state(const raster::MosaicMember& planned) {
  raster::ask_anew(planned.path);
  const std::string now = raster::state_of_raster(planned.path, planned.trust);
  return now == planned.state ? proto::Result<void>() : another_state(planned, now);
}

}  // namespace cordillera::pipeline::work
