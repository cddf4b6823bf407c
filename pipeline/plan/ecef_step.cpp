#include "pipeline/plan/ecef_step.h"

#include <algorithm>
#include <cmath>

#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr double kStepsPerTile = 262144;       // a tile's side, at least: walls and spikes stay where they are
constexpr double kStepShare = 1.0 / 64;        // of the target: quantisation must not spend the promise
constexpr double kExactStepShare = 1.0 / 512;  // an exact block has only what this leaves of its target
constexpr double kMostSteps = 1 << 21;         // of what a tile spans, and of half of the near heights: Draco keeps 2^23 exactly
constexpr double kRelief_m = 8192;             // of a tile and its skirts, if nothing is known
constexpr double kUnseenShare = 1.5;           // of the relief that was seen at a few places: what there may be

/// How far a tile of the level reaches over data.
double reach_m(const proto::Plan& plan, int level) {
  const proto::Lattice lattice = lattice_of(plan);
  return static_cast<double>(std::min(extent_of(plan), lattice.tile_units(level))) *
         proto::cell_height_m(lattice, lattice.rows() / 2);
}
double reach_m(const proto::Plan& plan, const proto::LevelPlan& level) { return reach_m(plan, static_cast<int>(level.level())); }

/// As fine as the level asks for; around a pole as fine as float32 allows.
double wanted_step_m(const proto::Plan& plan, const proto::LevelPlan& level) {
  if (reaches_pole(plan)) return 0;
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
  level.clear_far_ecef_step(), level.clear_near_low(), level.clear_near_high();
  if (plan.seen_heights_size() != 2) return;
  const double low_m = plan.seen_heights(0), high_m = plan.seen_heights(1), near = step_for(kUnseenShare * (high_m - low_m));
  if (near >= level.ecef_step()) return;
  level.set_far_ecef_step(level.ecef_step());
  level.set_ecef_step(near);
  level.set_near_low((low_m + high_m) / 2 - near * kMostSteps);
  level.set_near_high((low_m + high_m) / 2 + near * kMostSteps);
}

bool needs_heights(const proto::Plan& plan, double target_m) {
  proto::LevelPlan finest;
  finest.set_level(plan.finest_level());
  finest.set_target(target_m);
  return wanted_step_m(plan, finest) < least_step_m(plan, finest, kRelief_m);
}

gpu::EcefSteps ecef_steps(const proto::LevelPlan& level) {
  if (level.far_ecef_step() == 0) return level.ecef_step();
  return {level.ecef_step(), level.far_ecef_step(), level.near_low(), level.near_high()};
}

}  // namespace cordillera::pipeline
