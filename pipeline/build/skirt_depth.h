#pragma once
// How deep a tile's skirts must hang.
#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// Deep enough for a neighbour of another level, up to two levels coarser, on the common side. published: of built.mesh, not
/// empty. coarsest_level: that there is.
Skirts skirts_of(const LevelContext& context, const BuiltTile& built, const PublishedMesh& published, int coarsest_level);

}  // namespace cordillera::pipeline
