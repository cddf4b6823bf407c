#pragma once
// Blocks of an exact plan: where they lie, what gpu/exact is asked for, and tiles from what it gives.
#include <array>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/exact/simplify_block.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// The rectangle of a node that a block covers: whole tiles of the finest level that the plan's window touches.
struct BlockPlace {
  std::int64_t west = 0, south = 0, east = 0, north = 0;  ///< lattice vertices, ends included; west may exceed the circle
  std::array<gpu::exact::SideKind, 4> sides{};            ///< shared where the node beside it has a block up to there

  /// With what a shared side looks at.
  proto::Samples empty_samples() const;
};
BlockPlace place_of_block(const proto::Plan& plan, const proto::TileAddress& node);

/// Curvature over the rows of a block; see gpu::exact::Block.
struct BlockCurve {
  std::vector<gpu::exact::CurveRow> rows;
  float up = 0;
};
BlockCurve curve_of(const proto::Plan& plan, const BlockPlace& place);

/// Levels finest .. node's, each with its target less what rounding of .glb points and other programs' trigonometry may add.
gpu::exact::BlockPlan levels_of_block(const proto::Plan& plan, const proto::TileAddress& node);

/// Level z of a block as tiles, ordered by y then x. They hold published triangles alone, no void vertices, and are not measured yet; tiles
/// without any are left out.
std::vector<BuiltTile> tiles_of_block(const proto::Plan& plan, const BlockPlace& place, int z, const gpu::exact::BlockMesh& mesh);

/// States the tile's error, measured against the context's samples. Where a triangle is above the target, or upside down in space, vertices
/// are put back inside the tile first. How much of the error is above the target all the same; 0: nothing.
double measure_exact(const LevelContext& context, BuiltTile& tile);

}  // namespace cordillera::pipeline
