#include "pipeline/plan/ecef_step.h"

#include <algorithm>
#include <cmath>

#include "pipeline/plan/relief.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr double kStepsPerTile = 262144;       // a tile's side, at least: walls and spikes stay where they are
constexpr double kStepShare = 1.0 / 64;        // of the target: quantisation must not spend the promise
constexpr double kExactStepShare = 1.0 / 512;  // an exact block has only what this leaves of its target
constexpr double kMostSteps = 1 << 21;         // of what a tile spans, and from a step's middle height: Draco keeps 2^23 exactly
constexpr double kRelief_m = 8192;             // of a tile and its skirts
constexpr double kLeastStep_m = 0x1p-14;       // 32 km of it are whole numbers that Draco takes

/// How far a tile of the level reaches over data.
double reach_m(const proto::Plan& plan, int level) {
  const proto::Lattice lattice = lattice_of(plan);
  return static_cast<double>(std::min(extent_of(plan), lattice.tile_units(level))) *
         proto::cell_height_m(lattice, lattice.rows() / 2);
}
double reach_m(const proto::Plan& plan, const proto::LevelPlan& level) { return reach_m(plan, static_cast<int>(level.level())); }

/// As fine as the level asks for; around a pole as fine as float32 allows, but in exact blocks.
double wanted_step_m(const proto::Plan& plan, const proto::LevelPlan& level) {
  if (!plan.exact() && reaches_pole(plan)) return 0;
  return std::min(reach_m(plan, level) / kStepsPerTile,
                  possible_target_m(plan, level) * (plan.exact() ? kExactStepShare : kStepShare));
}

/// The least that holds all points of a tile.
double least_step_m(const proto::Plan& plan, const proto::LevelPlan& level, double relief_m) {
  return (reach_m(plan, level) + 2 * possible_target_m(plan, level) + relief_m) / kMostSteps;
}

}  // namespace

std::int64_t extent_of(const proto::Plan& plan) {
  return std::max(plan.window(2) - plan.window(0), plan.window(3) - plan.window(1)) + 1;
}

bool reaches_pole(const proto::Plan& plan) {
  const std::int64_t rows = lattice_of(plan).rows(), polar = rows / 128;
  return plan.window(1) < polar || plan.window(3) > rows - polar;
}

double greatest_target_m(const proto::Plan& plan, int level) { return reach_m(plan, level) + kRelief_m; }

double possible_target_m(const proto::Plan& plan, const proto::LevelPlan& level) {
  return std::min(level.target(), greatest_target_m(plan, static_cast<int>(level.level())));
}

double power_of_two_below(double value) { return std::exp2(std::floor(std::log2(value))); }

void set_ecef_steps(const proto::Plan& plan, proto::LevelPlan& level) {
  const auto step_for = [&](double relief_m) {
    return power_of_two_below(std::max(wanted_step_m(plan, level), least_step_m(plan, level, relief_m)));
  };
  level.set_ecef_step(step_for(kRelief_m));
  level.clear_coarsest_ecef_step(), level.clear_middle_height(), level.clear_near();
  const auto seen_m = seen_heights_m(plan);
  if (!seen_m) return;
  const double finest = std::max(step_for(0), kLeastStep_m);
  if (finest >= level.ecef_step()) return;
  level.set_coarsest_ecef_step(level.ecef_step());
  level.set_ecef_step(finest);
  level.set_middle_height((seen_m->first + seen_m->second) / 2);
  level.set_near(finest * kMostSteps);
}

bool needs_heights(const proto::Plan& plan, double target_m) {
  proto::LevelPlan finest;
  finest.set_level(plan.finest_level());
  finest.set_target(target_m);
  return wanted_step_m(plan, finest) < least_step_m(plan, finest, kRelief_m);
}

gpu::EcefSteps ecef_steps(const proto::LevelPlan& level) {
  if (level.coarsest_ecef_step() == 0) return level.ecef_step();
  return {level.ecef_step(), level.coarsest_ecef_step(), level.middle_height(), level.near()};
}

double usual_step_m(const proto::Plan& plan, const proto::LevelPlan& level) {
  const auto seen_m = seen_heights_m(plan);
  return seen_m ? ecef_steps(level).between(seen_m->first, seen_m->second) : level.ecef_step();
}

}  // namespace cordillera::pipeline
