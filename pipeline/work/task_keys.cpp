#include "pipeline/work/task_keys.h"

#include <algorithm>

#include "pipeline/build/exact/exact_above.h"
#include "pipeline/plan/ecef_step.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/work/work_plan.h"
#include "raster/mosaic/sheets.h"

namespace cordillera::pipeline::work {
namespace {

using proto::TileAddress;

/// What tells a raster and the way in which it is read from others.
std::string print_of(const proto::PlannedSource& source) {
  return source.spec().path() + "\n" + source.state() + "\n" + source.datum() + "\n" +
         source.spec().options().SerializeAsString();
}

std::string place(const TileAddress& node) {
  std::string text(1, '\n');
  for (const int number : {node.z, node.x, node.y}) text.append(std::to_string(number)).append(1, '/');
  return text;
}

}  // namespace

TaskKeys::TaskKeys(const proto::WorkPlan& plan) {
  proto::Plan numbers = plan.plan();
  numbers.clear_window();  // each block has its own part of it
  numbers.clear_source_state();
  numbers.clear_levels();
  numbers.clear_seen_heights();  // of all rasters; what a level has of them follows with its own numbers
  common_ = std::to_string(kPlanFormat) + "\n" + numbers.SerializeAsString();
  if (!plan.water_mask_state().empty()) common_ += "\nwater mask " + plan.water_mask_state();
  // Blocks leave something else then.
  if (has_levels_above(plan.plan())) common_ += "\nat once, codes by " + std::to_string(code_unit(plan.plan()));
  common_ += "\nrims " + std::to_string(most_rim_reach(plan.plan()));
  // A task does not depend on levels above its own, whose numbers change where the data comes to reach farther.
  for (const proto::LevelPlan& level : plan.plan().levels()) {
    numbers_ += level.SerializeAsString();
    if (level.coarsest_ecef_step() > 0) numbers_ += "\nstep " + std::to_string(usual_step_m(plan.plan(), level));
    levels_[static_cast<int>(level.level())] = numbers_;
  }
  std::vector<raster::MosaicMember> members;
  for (const proto::PlannedSource& source : plan.sources()) {
    sources_.push_back(print_of(source));
    members.push_back(member_of(source, source.spec().path(), raster::Trust::operator_file));
  }
  if (plan.options().feather() > 0) sheets_ = raster::sheets_of(members);
}

std::string TaskKeys::block(const TileAddress& node, const raster::Source::Window& window,
                            std::span<const std::uint32_t> sources) const {
  std::string text = common_ + levels_.at(node.z) + place(node);
  for (const std::int64_t side : {window.west, window.south, window.east, window.north})
    text.append(1, ' ').append(std::to_string(side));
  for (const std::uint32_t k : sources) {
    text.append(1, '\n').append(sources_[k]);
    // Rasters elsewhere decide which of these are sheets of one map.
    const auto of_one_map = [&](std::uint32_t other) { return sheets_[other] == sheets_[k]; };
    if (!sheets_.empty()) text.append(" map ").append(sources_[*std::find_if(sources.begin(), sources.end(), of_one_map)]);
  }
  return hex(content_hash(text));
}

std::string TaskKeys::above(const Keys& below) const {
  std::string text = common_ + numbers_ + "\nabove";
  for (const auto& [node, key] : below) text.append(place(node)).append(key);
  return hex(content_hash(text));
}

}  // namespace cordillera::pipeline::work
