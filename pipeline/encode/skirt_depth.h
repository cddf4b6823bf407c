#pragma once
// How deep a tile's skirts must hang.
#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"

namespace cordillera::pipeline {

/// Deep enough for a neighbour of another level, up to two levels coarser, on the common side. input: of the tile, but for its
/// skirts. published: of its mesh, not empty. level: the tile's. coarsest_level: that there is.
Skirts skirts_of(const EncodeInput& input, const PublishedMesh& published, const proto::LevelPlan& level, int coarsest_level);

}  // namespace cordillera::pipeline
