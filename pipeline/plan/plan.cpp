#include "pipeline/plan/plan.h"

#include <algorithm>
#include <cmath>

#include "gpu/exact/simplify_block.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/ecef_step.h"
#include "pipeline/plan/plan_options.h"
#include "pipeline/plan/relief.h"
#include "pipeline/plan/sample_places.h"
#include "proto/ellipsoid.h"
#include "proto/integers.h"
#include "raster/sample/back_projection.h"

namespace cordillera::pipeline {
namespace {

// error= when nothing is asked: a quarter of the finest cell, or what shows the relief if that is less; no less than a flat sea,
// cut into triangles of a decent size, is off for the earth's curvature, and what may be asked for.
constexpr double kDefaultErrorCells = 1.0 / 4, kDefaultErrorRelief = 1.0 / 50;
constexpr double kLeastDefaultCells = 1.0 / 64, kLeastDefault_m = 100;
// Of the target. Heights are most of a .drc: at 2 m a step of 1/4 m instead of a millimetre leaves less than half of its bytes,
// and adds 1/8 m at the most.
constexpr double kHeightStepShare = 1.0 / 8;
constexpr double kGreatestHeightStep_m = 4;    // seen from afar, mountains should not be terraces
constexpr double kRimCells = 0.5;              // that a rim may move in a level; over all finer levels that adds up to one cell
constexpr double kRimExtentShare = 1.0 / 256;  // small data keeps its outline, however coarse the level
constexpr int kBlockLevels = 2;                // of a block that has levels above it
constexpr int kLeastFinestLevel = 2;           // a chord of hundreds of kilometres sags
constexpr double kPixelShare = 1.0 / 10;       // of the finest target: see pixels_within_m

using proto::floor_divide;

bool has_cells_within_pixels(const proto::Source& source, int level, double share = raster::kMostSpacing) {
  return raster::spacing(source, {level}) <= share;
}

/// The first level whose cell height is no larger than the geometric mean of the source's pixel at its centre; than half of it
/// where the raster is a line of pixels, or two, which a whole cell of the lattice must fit into wherever it lies.
int level_of_mean_pixel(const proto::Source& source, double share) {
  const double pixel_m = share * std::sqrt(source.pixel_height_m() * source.pixel_width_m());
  const double latitude = (source.bbox(1) + source.bbox(3)) / 2;
  for (int z = 0; z < proto::kMaxLevel; ++z) {
    const proto::Lattice lattice{z};
    const double row = (latitude + 90) / 180 * static_cast<double>(lattice.rows());
    // A source of exactly one lattice spacing must not fall to the next level by the last bit of its pixel size.
    if (proto::cell_height_m(lattice, std::llround(row)) <= pixel_m * (1 + 1e-6)) return z;
  }
  return proto::kMaxLevel;
}

/// That, or a coarser one whose cells are well within pixels, as those of half of all rasters at the equator are: pixels in
/// degrees become narrow towards the poles, and so do cells.
int level_of_pixels(const proto::Source& source) {
  constexpr double kWellWithin = 0.7;
  const double share = std::min(source.columns(), source.rows()) <= 2 ? 0.5 : 1;
  int level = level_of_mean_pixel(source, share);
  while (level > 0 && has_cells_within_pixels(source, level - 1, share * kWellWithin)) --level;
  return level;
}

/// voids= a height. Beside ground that is a wall as high as the ground: to meet pixels on both sides of it, samples would leap
/// over it and below it.
bool paints_voids(const proto::BuildOptions& options) {
  return !options.voids().empty() && options.voids() != "fill" && options.voids() != "hole";
}

/// Whether the target is to hold at pixels, too: by default, where there is one.
bool is_to_meet_pixels(const proto::BuildOptions& options) {
  if (options.keep_size() > 0 || options.pixels() == raster::kLatticePixels) return false;
  return options.pixels() == raster::kExactPixels || !paints_voids(options);
}

/// Meeting pixels takes cells that are neither wider nor higher than they: those of a pixel that is up to four times as long
/// as it is wide are one level finer. Pixels of most of a degree and more have finer cells, too.
int finest_level(const proto::Source& source, const proto::BuildOptions& options) {
  const int level = std::max(level_of_pixels(source), kLeastFinestLevel);
  const bool finer = is_to_meet_pixels(options) && level < proto::kMaxLevel && !has_cells_within_pixels(source, level) &&
                     has_cells_within_pixels(source, level + 1);
  return finer ? level + 1 : level;
}

}  // namespace

proto::Result<std::pair<int, int>> level_range(const proto::Source& source, const proto::BuildOptions& options) {
  const int finest = options.has_max_level() ? static_cast<int>(options.max_level()) : finest_level(source, options);
  const int coarsest = static_cast<int>(options.min_level());
  if (finest > proto::kMaxLevel) {
    return proto::Problem{"option-invalid", "max_level " + std::to_string(finest) + " is too fine",
                          "0 to " + std::to_string(proto::kMaxLevel), "max_level"};
  }
  if (coarsest > finest) {
    return proto::Problem{"option-invalid",
                          "min_level " + std::to_string(coarsest) + " is above the finest level " + std::to_string(finest),
                          "0 to " + std::to_string(finest), "min_level"};
  }
  return std::pair{finest, coarsest};
}

std::int64_t columns_of(const proto::Plan& plan) { return plan.window(2) - std::int64_t{plan.window(0)} + 1; }
std::int64_t rows_of(const proto::Plan& plan) { return plan.window(3) - std::int64_t{plan.window(1)} + 1; }

namespace {

/// The coarsest level at which every node holds at most kBlockSamples of the window: places to look at are found by it.
int level_of_places(const proto::Plan& plan) {
  const proto::Lattice lattice = lattice_of(plan);
  for (int z = static_cast<int>(plan.min_level()); z < lattice.finest_level; ++z) {
    const std::int64_t across = lattice.tile_units(z) + 1;
    if (std::min(columns_of(plan), across) * std::min(rows_of(plan), across) <= kBlockSamples) return z;
  }
  return lattice.finest_level;
}

/// The coarsest level whose nodes, whole, have at most so many samples. Blocks have two levels or more, unless the plan has but
/// one.
int block_level(const proto::Plan& plan, std::int64_t most) {
  const proto::Lattice lattice = lattice_of(plan);
  int level = static_cast<int>(plan.min_level());
  while (level < lattice.finest_level - kBlockLevels + 1 &&
         (lattice.tile_units(level) + 1) * (lattice.tile_units(level) + 1) > most)
    ++level;
  return level;
}

std::int64_t samples_of(const proto::Plan& plan) { return columns_of(plan) * rows_of(plan); }

/// One piece, or blocks: several keep all threads and a GPU busy.
void plan_blocks(proto::Plan& plan) {
  plan.set_block_level(plan.min_level());
  const bool one_piece = samples_of(plan) <= kExactSamples &&
                         std::max(columns_of(plan), rows_of(plan)) + 2 * proto::kTileCells <= gpu::exact::kMostSamples;
  if (one_piece) return;
  const std::int64_t most = samples_of(plan) <= kMostSmallBlocks * kSmallExactSamples ? kSmallExactSamples
                            : samples_of(plan) <= kMostExactBlocks * kExactSamples    ? kExactSamples
                                                                                      : kBlockSamples;
  plan.set_block_level(static_cast<std::uint32_t>(block_level(plan, most)));
}

}  // namespace

proto::Lattice lattice_of(const proto::Plan& plan) { return {static_cast<int>(plan.finest_level())}; }

std::string named_strategy(const proto::BuildOptions& options) {
  const std::string& name = options.strategy();
  return name.empty() || name == kAutoStrategy || name == kFormerStrategy ? std::string(gpu::kExact) : name;
}

std::string strategy_of(const proto::Plan& plan) { return named_strategy(plan.options()); }

const proto::LevelPlan* find_level(const proto::Plan& plan, int level) {
  const auto& levels = plan.levels();
  const auto found = std::find_if(levels.begin(), levels.end(),
                                  [&](const proto::LevelPlan& of) { return static_cast<int>(of.level()) == level; });
  return found == levels.end() ? nullptr : &*found;
}

const proto::LevelPlan& level_plan(const proto::Plan& plan, int level) {
  return plan.levels(static_cast<int>(plan.finest_level()) - level);
}

std::int32_t height_step(const proto::LevelPlan& level) {
  return std::max(static_cast<std::int32_t>(std::lround(level.height_step() / proto::kHeightStep_m)), 1);
}

void derive_level(const proto::Plan& plan, proto::LevelPlan& level) {
  const proto::Lattice lattice = lattice_of(plan);
  const int z = static_cast<int>(level.level());
  const double target_m = possible_target_m(plan, level);
  set_ecef_steps(plan, level);
  const double height_step = std::min(target_m * kHeightStepShare, kGreatestHeightStep_m);
  level.set_height_step(power_of_two_below(std::max(height_step, proto::kHeightStep_m)));
  // Rounding takes its part, all of it where somebody asks for less than a float32 can tell.
  level.set_chain_tolerance(std::max(target_m - usual_step_m(plan, level) - level.height_step() / 2, 0.0));
  const double cell = static_cast<double>(lattice.cell_units(z));
  level.set_rim_tolerance(
      std::min(kRimCells * cell, std::max(kRimCells, static_cast<double>(extent_of(plan)) * kRimExtentShare)));
}

namespace {

/// level: whose cells it is measured by. Where the finest level is one finer for pixels that are not square, it is the one
/// before: the finest has no more to show.
double default_error_m(const proto::Plan& plan, int level) {
  const int coarser = static_cast<int>(plan.finest_level()) - level;
  const double cell_m = std::ldexp(proto::cell_height_m(lattice_of(plan), (plan.window(1) + plan.window(3)) / 2), coarser);
  const double sag_m = 2 * cell_m * cell_m / (8 * proto::kSemiMajor_m);  // of a cell's diagonal at the equator
  const double least_m = std::max(std::min(kLeastDefaultCells * cell_m, kLeastDefault_m), sag_m / (1 - kPixelShare));
  const auto seen_m = seen_heights_m(plan);
  const double relief_m = seen_m ? seen_m->second - seen_m->first : 0;
  const double error_m = std::min(kDefaultErrorCells * cell_m, std::max(kDefaultErrorRelief * relief_m, least_m));
  return std::max(error_m, kLeastError_m);
}

/// pixels= by name, "exact" or empty. What was asked for by name and cannot be is a problem.
proto::Result<void> choose_pixels(const proto::Source& source, proto::Plan& plan) {
  const bool asked = plan.options().pixels() == raster::kExactPixels;
  const bool fine = has_cells_within_pixels(source, static_cast<int>(plan.finest_level()));
  const std::string cells = "cells of level " + std::to_string(plan.finest_level());
  if (asked && plan.options().keep_size() > 0)
    return proto::Problem{"options-conflict",
                          "pixels=exact and keep are both given: a share of triangles is kept at samples alone",
                          "pixels=lattice, or error in place of keep", "pixels"};
  if (asked && !fine)
    return proto::Problem{"options-conflict", cells + " are wider than a pixel, or higher, so they cannot meet all pixels",
                          "pixels=lattice, or a finer max_level", "pixels"};
  if (fine && is_to_meet_pixels(plan.options()))
    plan.mutable_options()->set_pixels(raster::kExactPixels);
  else
    plan.mutable_options()->clear_pixels();
  return {};
}

/// Defaults that depend on the ground.
void look_at_ground(raster::Source& source, proto::Plan& plan) {
  const proto::BuildOptions& options = plan.options();
  const bool heights = !options.has_error() || needs_heights(plan, options.error()),
             sea = may_have_sea(options, source.description());
  if (!heights && !sea) return;
  const std::vector<proto::Samples> places = sample_places(plan, source);
  if (heights) see_heights(places, plan);
  if (sea && sees_sea(places, lattice_of(plan), source)) plan.mutable_options()->set_water(0);
}

}  // namespace

double pixels_within_m(const proto::Plan& plan) {
  return plan.options().pixels() == raster::kExactPixels ? kPixelShare * plan.levels(0).target() : 0;
}

proto::Result<proto::Plan> make_plan(raster::Source& source, const proto::BuildOptions& options) {
  if (const auto checked = check_options(options); !checked.ok()) return checked.problem();
  const auto range = level_range(source.description(), options);
  if (!range.ok()) return range.problem();
  proto::Plan plan;
  plan.set_format(kPlanFormat);
  plan.set_finest_level(static_cast<std::uint32_t>(range->first));
  plan.set_min_level(static_cast<std::uint32_t>(range->second));
  const proto::Lattice lattice = lattice_of(plan);
  const raster::Source::Window window = source.window(lattice);
  if (window.west > window.east || window.south > window.north) {
    return proto::Problem{"no-data", "no vertex of the tile lattice lies inside the raster (or bbox)",
                          "a larger bbox or a finer max_level", "bbox"};
  }
  for (const std::int64_t side : {window.west, window.south, window.east, window.north})
    plan.add_window(static_cast<std::int32_t>(side));
  *plan.mutable_options() = options;
  plan.set_exact(true);
  plan.set_promise(strategy_of(plan) == gpu::kExact || options.keep_size() == 0);
  plan.set_block_level(static_cast<std::uint32_t>(level_of_places(plan)));
  look_at_ground(source, plan);
  const int level_of_error = options.has_max_level() ? range->first : level_of_pixels(source.description());
  const double error = options.has_error() ? options.error() : default_error_m(plan, level_of_error);
  plan_blocks(plan);
  // How and where it is built changes no byte, so it is no part of the plan.
  plan.mutable_options()->clear_device();
  plan.mutable_options()->clear_threads();
  plan.mutable_options()->clear_memory();
  plan.mutable_options()->clear_warnings();
  plan.mutable_options()->clear_no_water();
  if (options.quality() == "default") plan.mutable_options()->clear_quality();
  if (const auto chosen = choose_pixels(source.description(), plan); !chosen.ok()) return chosen.problem();
  for (int z = range->first; z >= range->second; --z) {
    proto::LevelPlan* level = plan.add_levels();
    level->set_level(static_cast<std::uint32_t>(z));
    level->set_target(std::ldexp(error, range->first - z));
    derive_level(plan, *level);
  }
  return plan;
}

bool shows_sea(proto::Plan plan, const proto::BuildOptions& options, raster::Source& source) {
  if (!may_have_sea(options, source.description())) return false;
  plan.set_block_level(static_cast<std::uint32_t>(level_of_places(plan)));  // as in make_plan
  return sees_sea(sample_places(plan, source), lattice_of(plan), source);
}

void use_smaller_blocks(proto::Plan& plan, std::int64_t most) {
  plan.set_block_level(std::max(plan.block_level(), static_cast<std::uint32_t>(block_level(plan, most))));
  for (proto::LevelPlan& numbers : *plan.mutable_levels()) derive_level(plan, numbers);
}

namespace {

/// Rows and columns of tiles, both ends included.
struct TileRange {
  std::int64_t west = 0, south = 0, east = 0, north = 0;
};

/// What the plan's window touches of a range of a level's tiles. Closed rectangles: data that only touches a tile's border gives
/// that tile a border to share.
std::vector<proto::TileAddress> touched_within(const proto::Plan& plan, int level, const TileRange& range) {
  const std::int64_t units = lattice_of(plan).tile_units(level), across = proto::tiles_across(level);
  const std::int64_t from = floor_divide(plan.window(0) - 1, units),
                     more = std::min(floor_divide(plan.window(2), units) - from, across - 1);
  const std::int64_t west = from - across * floor_divide(from, across);
  std::vector<std::int64_t> columns;  // the window may go on beyond the antimeridian: then it begins again at column 0
  for (const std::int64_t turn : {-across, std::int64_t{0}}) {
    for (std::int64_t x = std::max(range.west, west + turn); x <= std::min(range.east, west + turn + more); ++x)
      columns.push_back(x);
  }
  const std::int64_t south = std::max(range.south, floor_divide(plan.window(1) - 1, units));
  const std::int64_t north = std::min(range.north, floor_divide(plan.window(3), units));
  std::vector<proto::TileAddress> tiles;
  for (std::int64_t y = south; y <= north; ++y) {
    for (const std::int64_t x : columns) tiles.push_back({level, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)});
  }
  return tiles;
}

}  // namespace

std::vector<proto::TileAddress> touched_tiles(const proto::Plan& plan, int level, const proto::TileAddress& node) {
  const std::int64_t size = std::int64_t{1} << (level - node.z);
  return touched_within(plan, level, {node.x * size, node.y * size, (node.x + 1) * size - 1, (node.y + 1) * size - 1});
}

std::vector<proto::TileAddress> touched_tiles(const proto::Plan& plan, int level) {
  return touched_within(plan, level, {0, 0, proto::tiles_across(level) - 1, proto::tiles_up(level) - 1});
}

raster::Source::Window node_window(const proto::Plan& plan, const proto::TileAddress& node, std::int64_t around) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t circle = lattice.columns();
  const std::int64_t units = std::min(lattice.tile_units(node.z) + 2 * around, circle);
  const std::int64_t node_west = lattice.west(node) - around, node_south = lattice.south(node) - around;
  raster::Source::Window result{
      INT64_MAX, std::max<std::int64_t>(node_south, plan.window(1)), INT64_MIN,
      std::min<std::int64_t>(lattice.south(node) + lattice.tile_units(node.z) + around, plan.window(3))};
  for (int turn = -2; turn <= 2; ++turn) {
    const std::int64_t west = std::max<std::int64_t>(node_west + turn * circle, plan.window(0));
    const std::int64_t east = std::min<std::int64_t>(node_west + turn * circle + units, plan.window(2));
    if (west > east) continue;
    // Data on both ends of the circle, be it a line that the node ends at: the whole node, once.
    if (result.west <= result.east && units < circle) return {node_west, result.south, node_west + units, result.north};
    result.west = std::min(result.west, west);
    result.east = std::max(result.east, east);
  }
  return result;
}

double samples_of(const proto::Plan& plan, const proto::TileAddress& node) {
  const raster::Source::Window w = node_window(plan, node);
  return w.west > w.east || w.south > w.north
             ? 0
             : static_cast<double>(w.east - w.west + 1) * static_cast<double>(w.north - w.south + 1);
}

}  // namespace cordillera::pipeline
