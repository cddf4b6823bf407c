#pragma once
// What points of .glb tiles are rounded to: the numbers of a plan that set_ecef_steps() chooses, and what they are chosen by.
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// The longer side of the plan's window, in finest lattice vertices.
std::int64_t extent_of(const proto::Plan& plan);
/// Columns are closer than any step there.
bool reaches_pole(const proto::Plan& plan);
/// The level's target, or the greatest that can matter.
double possible_target_m(const proto::Plan& plan, const proto::LevelPlan& level);
double power_of_two_below(double value);

/// From the level's target and, if heights were seen, from those.
void set_ecef_steps(const proto::Plan& plan, proto::LevelPlan& level);
/// Of points at the heights that were seen, at most.
double usual_step_m(const proto::Plan& plan, const proto::LevelPlan& level);
/// Would heights that were seen change the steps of any level? target_m: of the finest level, whose steps are the finest.
bool needs_heights(const proto::Plan& plan, double target_m);

}  // namespace cordillera::pipeline
