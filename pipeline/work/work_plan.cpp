#include "pipeline/work/work_plan.h"

#include <cmath>
#include <map>

#include "pipeline/builder.h"
#include "pipeline/content_hash.h"
#include "pipeline/manifest_json.h"
#include "pipeline/pilot.h"
#include "pipeline/plan.h"
#include "proto/mesh.h"
#include "proto/version.h"
#include "raster/storage.h"

namespace cordillera::pipeline::work {
namespace {

using proto::TileAddress;
using Keys = std::map<TileAddress, std::string>;

/// The options of a build that say how a raster is read.
proto::BuildOptions reading(const proto::BuildOptions& options) {
  proto::BuildOptions out;
  out.set_crs(options.crs());
  out.set_vertical_datum(options.vertical_datum());
  out.set_nodata(options.nodata());
  out.set_source_nodata(options.source_nodata());
  if (options.has_z_scale()) out.set_z_scale(options.z_scale());
  if (options.has_z_offset()) out.set_z_offset(options.z_offset());
  *out.mutable_bbox() = options.bbox();
  return out;
}

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
  return source;
}

raster::MosaicMember member_of(const proto::PlannedSource& source) {
  const auto side = [&](int k) { return static_cast<std::int64_t>(source.window(k)); };
  return {source.spec().path(), source.spec().name(), raster::Trust::operator_file, source.spec().options(), source.description(),
          {side(0), side(1), side(2), side(3)}, source.state(), source.datum()};
}

/// Keys of tasks: what is common to all of them, then what each has of its own.
class Namer {
 public:
  explicit Namer(const proto::WorkPlan& plan) : plan_(plan) {
    proto::Plan numbers = plan.plan();
    numbers.clear_window();  // each block has its own part of it
    numbers.clear_source_state();
    common_ = std::to_string(kPlanFormat) + "\n" + numbers.SerializeAsString();
    for (const proto::PlannedSource& source : plan.sources()) {
      sources_.push_back(source.spec().path() + "\n" + source.state() + "\n" + source.datum() + "\n" + source.spec().options().SerializeAsString());
    }
  }

  std::string block(const TileAddress& node, const raster::Source::Window& window, const proto::WorkTask& task) const {
    std::string text = common_ + place(node);
    for (const std::int64_t side : {window.west, window.south, window.east, window.north}) text.append(1, ' ').append(std::to_string(side));
    for (const std::uint32_t k : task.sources()) text.append(1, '\n').append(sources_[k]);
    return hex(content_hash(text));
  }

  std::string merge(const TileAddress& node, const Keys& below) const {
    std::string text = common_ + place(node);
    for (int c = 0; c < 4; ++c) {
      const auto child = below.find(node.child(c));
      text.append(1, ' ').append(child == below.end() ? "-" : child->second);
    }
    return hex(content_hash(text));
  }

 private:
  static std::string place(const TileAddress& node) {
    std::string text(1, '\n');
    for (const int number : {node.z, node.x, node.y}) text.append(std::to_string(number)).append(1, '/');
    return text;
  }
  const proto::WorkPlan& plan_;
  std::string common_;
  std::vector<std::string> sources_;
};

proto::WorkTask task_at(const TileAddress& node) {
  proto::WorkTask task;
  task.set_level(static_cast<std::uint32_t>(node.z));
  task.set_x(static_cast<std::uint32_t>(node.x));
  task.set_y(static_cast<std::uint32_t>(node.y));
  return task;
}

/// Blocks that some raster may touch, with the rasters; what none touches has no data and is no task.
Keys add_blocks(const Namer& namer, proto::WorkPlan& work) {
  const proto::Plan& plan = work.plan();
  const proto::Lattice lattice = lattice_of(plan);
  const int level = static_cast<int>(plan.block_level());
  const std::int64_t beside = lattice.cell_units(level) + (work.sources_size() > 1 ? raster::feather_vertices(work.options().feather(), lattice) : 0);
  std::vector<raster::Source::Window> windows;
  for (const proto::PlannedSource& source : work.sources()) windows.push_back(raster::coarser(member_of(source).window, lattice));
  Keys keys;
  proto::WorkStage* stage = work.add_stages();
  for (const TileAddress& node : touched_tiles(plan, level)) {
    const raster::Source::Window window = node_window(plan, node, lattice.cell_units(level));
    if (window.west > window.east || window.south > window.north) continue;
    const raster::Source::Window read{window.west - beside, window.south - beside, window.east + beside, window.north + beside};
    proto::WorkTask task = task_at(node);
    for (std::size_t k = 0; k < windows.size(); ++k) {
      if (raster::touch(windows[k], read, lattice)) task.add_sources(static_cast<std::uint32_t>(k));
    }
    if (task.sources_size() == 0) continue;
    task.set_samples(static_cast<double>(window.east - window.west + 1) * static_cast<double>(window.north - window.south + 1));
    task.set_key(namer.block(node, window, task));
    keys[node] = task.key();
    *stage->add_tasks() = task;
  }
  return keys;
}

void add_merges(const Namer& namer, Keys below, proto::WorkPlan& work) {
  for (int z = static_cast<int>(work.plan().block_level()) - 1; z >= static_cast<int>(work.plan().min_level()); --z) {
    Keys keys;
    proto::WorkStage* stage = work.add_stages();
    for (const auto& [child, key] : below) keys.try_emplace(child.parent());
    for (auto& [node, key] : keys) {
      proto::WorkTask task = task_at(node);
      task.set_key(namer.merge(node, below));
      key = task.key();
      *stage->add_tasks() = task;
    }
    below = std::move(keys);
  }
}

proto::Problem unreadable(const std::string& path, const std::string& why) {
  return {"plan-invalid", path + " " + why, "a folder that `cordillera plan` wrote", ""};
}

}  // namespace

proto::Result<proto::WorkPlan> plan_work(const BuildRequest& request, const std::atomic<bool>& stop) {
  const auto source = open_source(request);
  if (!source.ok()) return source.problem();
  auto plan = plan_of(request, **source);
  if (!plan.ok()) return plan.problem();
  if (request.options.keep_size() > 0) {
    Workers workers(request.options.threads());
    Builder builder(*plan, workers, [&] { return open_source(request); }, request.options.device(), stop);
    if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
    if (const auto piloted = run_pilot(builder, *plan, stop); !piloted.ok()) return piloted.problem();
  }
  proto::WorkPlan work;
  work.set_format(kPlanFormat);
  *work.mutable_plan() = *plan;
  *work.mutable_options() = request.options;
  work.set_name(request.raster_name);
  for (const raster::MosaicMember& member : request.members) *work.add_sources() = planned(member);
  *work.mutable_source() = (*source)->description();
  const double resampled_m = (*source)->resampling_error_m(lattice_of(*plan));
  work.mutable_source()->set_resampling_error(std::nearbyint(resampled_m / proto::kHeightStep_m) * proto::kHeightStep_m);
  const Namer namer(work);
  add_merges(namer, add_blocks(namer, work), work);
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
  if (!parse_json(**json, &plan) || !plan.has_plan() || plan.stages_size() == 0) {
    return unreadable(path, "is no plan");
  }
  if (plan.format() != kPlanFormat || plan.plan().program() != proto::kProgram) {
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

proto::Result<void> check_unchanged(const raster::MosaicMember& planned) {
  const auto now = raster::examine(planned.path, planned.name, planned.trust, planned.options);
  if (!now.ok()) return now.problem();
  if (now->state != planned.state) {
    return proto::Problem{"source-changed", planned.path + " is not what it was when the plan was made (then " + planned.state + ", now " + now->state + ")",
                   "the same files as planned, or a new plan", ""};
  }
  if (now->datum != planned.datum) {
    return proto::Problem{"source-changed", "the geoid grid for " + planned.path + " differs from the plan's (undulations " + now->datum + ", planned " +
                   planned.datum + ")", "the same grid files on every machine, or a new plan", ""};
  }
  return {};
}

}  // namespace cordillera::pipeline::work
