#pragma once
// Subtree files of the terrain tileset: which tiles there are, and for each what a terrain provider culls and sorts it by.
#include <optional>
#include <string>

#include "pipeline/faces/terrain.h"

namespace cordillera::pipeline::faces {

inline constexpr int kTerrainSubtreeLevels = 4;

/// None where root is not at a multiple of those levels, or the face has no tile there.
std::optional<std::string> terrain_subtree(const Terrain& terrain, const proto::TileAddress& root);

}  // namespace cordillera::pipeline::faces
