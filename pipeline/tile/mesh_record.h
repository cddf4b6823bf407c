#pragma once
// A finished mesh on its way to the parent's weld, in bytes: what crosses a restart or a process border.
#include <string>

#include "pipeline/tile/tile_mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

std::string to_bytes(const BuiltTile& tile);
proto::Result<BuiltTile> tile_from_bytes(const proto::TileAddress& tile, const std::string& bytes);

}  // namespace cordillera::pipeline
