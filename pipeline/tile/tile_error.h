#pragma once
// The error of a block's tile, made to keep the promise. Above the blocks: build/exact/error_statement.h.
#include <cstdint>
#include <vector>

#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// A limit that is less than so many times what rounding may make of an error is none: edges would be turned for that alone.
inline constexpr double kNearRounding = 1.35;

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
/// The same of a tile; where that is near rounding_m(), kNearRounding times it.
double limit_of(const LevelContext& context, const proto::TileAddress& tile);

/// A tile, and the samples that it is measured against.
gpu::SurfaceErrorInput surface_input(const LevelContext& context, const BuiltTile& built);

/// Against every finest sample; what exceeds limit_of() the tile is refined, and so are triangles that are upside down in space.
/// memory: of the tile at that limit.
void measure(const LevelContext& context, BuiltTile& built, gpu::SurfaceMemory& memory);

}  // namespace cordillera::pipeline
