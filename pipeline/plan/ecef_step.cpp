#include "pipeline/plan/ecef_step.h"

#include <algorithm>
#include <cmath>

#include "pipeline/plan/relief.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr double kStepsPerTile = 262144;  // a tile's side, at least: walls and spikes stay where they are
constexpr double kStepShare = 1.0 / 512;  // of the target: a block has only what this leaves of it
constexpr double kMostSteps = 1 << 21;    // of what a tile spans, and from a step's middle height: Draco keeps 2^23 exactly
constexpr double kRelief_m = 8192;        // of a tile and its skirts
constexpr double kLeastStep_m = 0x1p-14;  // 32 km of it are whole numbers that Draco takes
constexpr double kPoleHeight_m = 1024;    // so near is enough, and seldom another one when rasters are added

/// The width of a column, of the height of a row: the greatest in the plan's window where that lies around a pole, else 1.
double column_width(const proto::Plan& plan) {
  constexpr double kNarrow = 1.0 / 8;
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t middle = lattice.rows() / 2, low = std::max<std::int64_t>(plan.window(1), 0), high = plan.window(3);
  if (low <= middle && high >= middle) return 1;
  const double widest = proto::row_frame(lattice, low > middle ? low : std::min(high, lattice.rows())).cos_lat;
  return widest < kNarrow ? widest : 1;
}

/// How far a tile of the level reaches over data.
double reach_m(const proto::Plan& plan, int level) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t tile = lattice.tile_units(level);
  return std::max(static_cast<double>(std::min(columns_of(plan), tile)) * column_width(plan),
                  static_cast<double>(std::min(rows_of(plan), tile))) *
         proto::cell_height_m(lattice, lattice.rows() / 2);
}
double reach_m(const proto::Plan& plan, const proto::LevelPlan& level) { return reach_m(plan, static_cast<int>(level.level())); }

/// As fine as the level asks for.
double wanted_step_m(const proto::Plan& plan, const proto::LevelPlan& level) {
  return std::min(reach_m(plan, level) / kStepsPerTile, possible_target_m(plan, level) * kStepShare);
}

/// The least that holds all points of a tile.
double least_step_m(const proto::Plan& plan, const proto::LevelPlan& level, double relief_m) {
  return (reach_m(plan, level) + 2 * possible_target_m(plan, level) + relief_m) / kMostSteps;
}

}  // namespace

std::int64_t extent_of(const proto::Plan& plan) { return std::max(columns_of(plan), rows_of(plan)); }

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
  level.clear_coarsest_ecef_step(), level.clear_middle_height(), level.clear_near(), level.clear_near_pole();
  const auto seen_m = seen_heights_m(plan);
  const double middle_m = seen_m ? (seen_m->first + seen_m->second) / 2 : 0;
  const double finest = seen_m ? std::max(step_for(0), kLeastStep_m) : level.ecef_step();
  if (finest < level.ecef_step()) {
    level.set_coarsest_ecef_step(level.ecef_step());
    level.set_ecef_step(finest);
    level.set_middle_height(middle_m);
    level.set_near(finest * kMostSteps);
  }
  // A tile of level 0 reaches from pole to pole, which is too many of the smallest steps.
  if (!reaches_pole(plan) || level.level() == 0) return;
  constexpr double kRoom = 15.0 / 16;  // for what a tile's translation is rounded by
  level.set_near_pole(level.ecef_step() * kMostSteps * kRoom);
  if (level.coarsest_ecef_step() == 0) level.set_middle_height(kPoleHeight_m * std::rint(middle_m / kPoleHeight_m));
}

bool needs_heights(const proto::Plan& plan, double target_m) {
  proto::LevelPlan finest;
  finest.set_level(plan.finest_level());
  finest.set_target(target_m);
  return wanted_step_m(plan, finest) < least_step_m(plan, finest, kRelief_m);
}

gpu::EcefSteps ecef_steps(const proto::LevelPlan& level) {
  const double finest = level.ecef_step();
  if (level.coarsest_ecef_step() == 0) return {finest, finest, level.middle_height(), INFINITY, level.near_pole()};
  return {finest, level.coarsest_ecef_step(), level.middle_height(), level.near(), level.near_pole()};
}

double usual_step_m(const proto::Plan& plan, const proto::LevelPlan& level) {
  const auto seen_m = seen_heights_m(plan);
  return seen_m ? ecef_steps(level).between(seen_m->first, seen_m->second) : level.ecef_step();
}

}  // namespace cordillera::pipeline
