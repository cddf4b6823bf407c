#pragma once
// Vertices on the side of two tiles that are built together.
#include <cstddef>
#include <functional>
#include <map>
#include <vector>

#include "gpu/mesh/mesh_point.h"
#include "pipeline/threads/workers.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// Puts samples on sides into both tiles of each side, so that their common vertices stay the same, and with them as many other
/// samples of the side as keep its edges as near to all of them as they were. tiles: of the finest level; what was measured of
/// those that change is no longer true. on_sides: indexed as tiles, see MetPixels. Where the mesh ends on the side, it alone gets
/// them. Nothing goes in where the tile beyond the side is not among tiles, where the edge or a sample that it passes has no
/// data, or where a corner has no room for a neighbour more and can get none (gpu::split_side). Returns the tiles that changed,
/// as they were.
std::map<std::size_t, BuiltTile> put_on_sides(const LevelContext& context, std::vector<BuiltTile>& tiles,
                                              const std::vector<std::vector<gpu::MeshPoint>>& on_sides);

/// Finishes a tile and returns which samples it needs on its sides; called by several threads, for a tile again when its sides
/// have changed.
using FinishTile = std::function<std::vector<gpu::MeshPoint>(std::size_t tile, unsigned worker)>;

/// Finishes all tiles of the finest level, then those again whose sides got vertices. Where that leaves one above the target and
/// worse than it was, all of them are as they were before.
void finish_with_sides(const LevelContext& context, std::vector<BuiltTile>& tiles, Workers& workers, const FinishTile& finish,
                       Workers::Haste haste = Workers::Haste::none);

}  // namespace cordillera::pipeline
