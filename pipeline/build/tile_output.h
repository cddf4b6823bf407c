#pragma once
// From a finished mesh to what the store keeps of it.
#include <optional>

#include "cordillera.pb.h"
#include "pipeline/store/store.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {

/// nullopt: the tile publishes no triangle. options: of the plan; what its tiles are to carry.
std::optional<EncodedTile> encode_tile(const LevelContext& context, const BuiltTile& built, const proto::BuildOptions& options);

}  // namespace cordillera::pipeline
