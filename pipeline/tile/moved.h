#pragma once
// Border vertices that had to step inside (gpu/waves/border/nudge.h): they brought their heights along, which is no height of
// where they stand now.
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// Gives vertices of a simplification's result that are none of its input the height of the place: the sample's or, above the
/// blocks, that of the children's surface. Where neither has data they stay as they are.
void settle_moved(const LevelContext& context, const PreparedTile& prepared, proto::TileMesh& mesh);

}  // namespace cordillera::pipeline
