#pragma once
// Blocks of a plan: where they lie, what gpu/exact is asked for, and tiles from what it gives.
#include <array>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/exact/simplify_block.h"
#include "pipeline/tile/tile_mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// The rectangle of a node that a block covers.
struct BlockPlace {
  std::int64_t west = 0, south = 0, east = 0, north = 0;  ///< lattice vertices, ends included; west may exceed the circle
  std::array<gpu::exact::SideKind, 4> sides{};
  bool merged_above = false;  ///< levels above need its mesh

  /// With what a shared side looks at.
  raster::Source::Window window() const;
  proto::Samples empty_samples() const;
};
/// Of a node of the plan's block level. Where levels are merged above it, the whole node, all of whose sides are shared: then
/// nothing of a block depends on which others there are, and where it has no data its sides have the vertices that a missing
/// neighbour is taken to have. Else the tiles of the finest level that the plan's window touches, sides shared where the node
/// beside it has a block up to there; west > east where the window ends on a side of the node, or does not touch it.
BlockPlace place_of_block(const proto::Plan& plan, const proto::TileAddress& node);
/// The tiles of any node that the plan's window touches, as if there were no others: a sample of a dry run.
BlockPlace place_alone(const proto::Plan& plan, const proto::TileAddress& node);

/// Curvature over the rows of a block; see gpu::exact::Block.
struct BlockCurve {
  std::vector<gpu::exact::CurveRow> rows;
  float up = 0;
};
BlockCurve curve_of(const proto::Plan& plan, const BlockPlace& place);

/// 2 to the power of it: samples that rims may move by on the coarsest levels; -1: none. A function of the window's narrower
/// side, for small data keeps its outline.
int most_rim_reach(const proto::Plan& plan);

/// All that gpu/exact is told of a block. Borrows samples and curve.
gpu::exact::Block block_at(const proto::Plan& plan, const BlockPlace& place, const proto::Samples& samples,
                           const BlockCurve& curve);

/// Levels finest .. coarsest, each with its target less what rounding of .glb points and other programs' trigonometry may add.
gpu::exact::BlockPlan levels_of_block(const proto::Plan& plan, int coarsest);
/// The same of a block with these samples: one that is all of the data keeps what is narrow.
gpu::exact::BlockPlan levels_of_block(const proto::Plan& plan, int coarsest, const BlockPlace& place,
                                      const proto::Samples& samples);
/// Lets rims move less, but by 2^least samples, where otherwise less than half of the data would be left. all: of it; what is
/// decided is a function of where it has data.
void keep_narrow_data(const gpu::exact::Ground& all, int least, gpu::exact::BlockPlan& levels);
/// A block that is all of the data, for that: where its squares have some.
gpu::exact::Ground places_of_data(const proto::Samples& samples);
/// See gpu::exact::Block.
double sample_m(const proto::Plan& plan);

/// None of its corners is void.
inline bool is_published(const gpu::exact::BlockMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  return !mesh.is_void[triangle[0]] && !mesh.is_void[triangle[1]] && !mesh.is_void[triangle[2]];
}

/// Level z of a block as tiles, ordered by y then x, not measured yet: max_error_m is what the engine knows, if it says so.
/// published: their published triangles alone, without void vertices; tiles without any are left out, and of one that reaches
/// beyond the place, what lies there is. whole: all of them.
enum class TileParts { published, whole };
std::vector<BuiltTile> tiles_of_block(const proto::Plan& plan, const BlockPlace& place, int z, const gpu::exact::BlockMesh& mesh,
                                      TileParts parts = TileParts::published);

/// A block that is a whole node, void triangles too. side: of the node, units.
proto::TileMesh tile_mesh_of_block(const gpu::exact::BlockMesh& mesh, std::int32_t side);

/// States the tile's error, measured against the context's samples. Where a triangle is above the target, or upside down in
/// space, vertices are put back inside the tile first. How much of the error is above the target all the same; 0: nothing.
/// memory: of the tile at limit_of()
double measure_exact(const LevelContext& context, BuiltTile& tile, gpu::SurfaceMemory& memory);

}  // namespace cordillera::pipeline
