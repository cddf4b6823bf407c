#pragma once
// The terrain's normals over a tile as a picture: relief that the tile's own triangles are too few to show.
#include <cstdint>
#include <vector>

#include "pipeline/faces/terrain.h"
#include "proto/lattice.h"

namespace cordillera::pipeline::faces {

/// How many. tests/bench/normals has what more and less come to.
inline constexpr int kFinerLevels = 2;

/// kNormalMapSide * kNormalMapSide pixels of three bytes, by row from the north: east, north and up, -1 to 1 as 0 to 255. A pixel
/// is at a vertex of the level's lattice, so two tiles have the same pixels on their common side. The greatest of the three
/// numbers is 1 or -1: glTF's clients scale normals, and where no slope is above 45 degrees the third byte is always 255, which
/// costs nothing.
///
/// The surface is that of meshes some levels finer, or of the finest that are there. A pixel beside it has the normal of the
/// pixels around; from the third pixel beside it on, up.
std::vector<std::uint8_t> normal_map(const Terrain& terrain, const proto::TileAddress& tile, int finer_levels = kFinerLevels);

}  // namespace cordillera::pipeline::faces
