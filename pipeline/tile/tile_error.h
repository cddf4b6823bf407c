#pragma once
// The error of a tile's mesh, made to keep the promise, and what levels above need to know of it. Of every strategy: waves and
// others that simplify tile by tile come here from tile_mesh.cpp, exact from build/exact/exact_block.cpp. compose() is of the
// first alone; exact states its errors above the blocks in build/exact/error_statement.h.
#include <cstdint>
#include <vector>

#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

inline constexpr double kLeastStepShare = 0.25;  ///< of the target, for the step above the blocks, even where children left less

/// Triangles that refinement leaves over the limit are made one by one (gpu::refine_stuck) where there are no more of a tile: a
/// handful are needles along steep walls, and where there are many, nothing helps.
inline constexpr std::size_t kMostLeftOver = 16;

/// Two ascending lists of triangles as one.
std::vector<std::uint32_t> in_either(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b);

/// What the rounding of points and heights alone may make of an error along the normal, on ground that is not steep, metres. No
/// vertex and no other edge lessens it; where triangles that have no more were refined, edges were turned for nothing, into
/// needles that lie between samples and far from pixels.
double rounding_m(const proto::LevelPlan& level, const proto::Lattice& lattice, const proto::TileAddress& tile);

/// The level's target, less what is added to every error that is stated.
double limit_of(const LevelContext& context);
/// The same of a tile; where that is near rounding_m(), least_limit times it.
double limit_of(const LevelContext& context, const proto::TileAddress& tile);

/// A tile, and the samples that it is measured against.
gpu::SurfaceErrorInput surface_input(const LevelContext& context, const BuiltTile& built);

/// Against every finest sample; what exceeds limit_of() the tile is refined, where there is a promise. Returns the triangles that
/// are still over it. memory: of the tile at that limit.
std::vector<std::uint32_t> measure(const LevelContext& context, BuiltTile& built, gpu::SurfaceMemory& memory);

/// Against finer surfaces, whose own errors are known. Returns the triangles that are still over the limit.
std::vector<std::uint32_t> compose(const LevelContext& context, const PreparedTile& prepared, BuiltTile& built, double limit_m);

/// Gives a tile that is done what levels above need: what it leaves uncovered, and the surface that it was made of. Takes it from
/// prepared.
void hand_up(const LevelContext& context, PreparedTile& prepared, BuiltTile& built);

}  // namespace cordillera::pipeline
