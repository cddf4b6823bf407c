#pragma once
// The numbers fixed before any tile is built.
#include <string>
#include <utility>

#include "cordillera.pb.h"
#include "gpu/measure/ecef_steps.h"
#include "proto/lattice.h"
#include "proto/result.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Of plans and of what their tasks leave, which fits together within a format alone.
inline constexpr unsigned kPlanFormat = 8;

/// Finest samples a block may have: what one block task holds in memory, 5 bytes each.
inline constexpr std::int64_t kBlockSamples = std::int64_t{4097} * 4097;
/// A raster of up to so many is one block; and so large are the blocks of a large one. Who asks for one tile
/// of a lazy dataset waits for its block. But provisional tiles reach down to the level of the blocks: with more of them than
/// this they would take too long, and blocks are larger.
inline constexpr std::int64_t kExactSamples = std::int64_t{2049} * 2049, kMostExactBlocks = 1024;
/// Rasters between have smaller blocks, for the same reason. They cost one percent of triangles.
inline constexpr std::int64_t kSmallExactSamples = std::int64_t{1025} * 1025, kMostSmallBlocks = 128;
/// The default strategy: exact. So is one that earlier versions had, and whose name is in files of options and in datasets.
inline constexpr const char *kAutoStrategy = "auto", *kFormerStrategy = "waves";

/// Plans everything but the targets of keep=, which need a pilot (see pilot.h): levels, blocks, targets, steps.
proto::Result<proto::Plan> make_plan(raster::Source& source, const proto::BuildOptions& options);

/// The finest and the coarsest level of a build. Problems: "option-invalid".
proto::Result<std::pair<int, int>> level_range(const proto::Source& source, const proto::BuildOptions& options);

/// No error of a tile of the level is greater, nor need a target be: all that the tile spans, and all relief.
double greatest_target_m(const proto::Plan& plan, int level);

/// Whether a new plan of the source, with these options, would take 0 for the height of water by itself. plan: another one of the
/// same source.
bool shows_sea(proto::Plan plan, const proto::BuildOptions& options, raster::Source& source);

/// Blocks of up to so many finest samples, or the smallest that there can be.
void use_smaller_blocks(proto::Plan& plan, std::int64_t most);

/// How near to the raster's own pixels the surface between samples is brought before anything is simplified, metres; 0: samples
/// stay as they are, and the error counts at samples alone. It leaves simplification the rest of the finest target.
double pixels_within_m(const proto::Plan& plan);

/// Sets what sides may deviate, .glb steps, height step and rim tolerance of a level from its target.
void derive_level(const proto::Plan& plan, proto::LevelPlan& level);

proto::Lattice lattice_of(const proto::Plan& plan);
/// Lattice vertices of its window, both ends included: where data goes around the earth, one more than the circle has.
std::int64_t columns_of(const proto::Plan& plan);
std::int64_t rows_of(const proto::Plan& plan);
/// The strategy that is named, else exact.
std::string named_strategy(const proto::BuildOptions& options);
/// Of gpu::kStrategies: what builds.
std::string strategy_of(const proto::Plan& plan);
const proto::LevelPlan& level_plan(const proto::Plan& plan, int level);
/// The same by its number, of a plan that may be of a damaged store; null: it has no such level.
const proto::LevelPlan* find_level(const proto::Plan& plan, int level);
/// What points of the level's .glb tiles are rounded to.
gpu::EcefSteps ecef_steps(const proto::LevelPlan& level);
/// What heights of the level's meshes are multiples of, in kHeightStep_m; 1 where the level does not say.
std::int32_t height_step(const proto::LevelPlan& level);

/// Tiles of level z whose closed rectangle touches the plan's window; x modulo the circle, ordered by y then x, none twice.
std::vector<proto::TileAddress> touched_tiles(const proto::Plan& plan, int level);
/// The same below one node, whose level is no greater; its time and memory are of that node's tiles alone.
std::vector<proto::TileAddress> touched_tiles(const proto::Plan& plan, int level, const proto::TileAddress& node);

/// The lattice vertices of node's closed rectangle, and `around` units more on every side, inside the plan's window: what a block
/// reads. west may exceed the circle.
raster::Source::Window node_window(const proto::Plan& plan, const proto::TileAddress& node, std::int64_t around = 0);
/// How many of them there are without those around; 0: the node has no part of the window.
double samples_of(const proto::Plan& plan, const proto::TileAddress& node);

}  // namespace cordillera::pipeline
