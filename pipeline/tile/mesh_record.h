#pragma once
// A finished mesh on its way to the parent's weld, in bytes: what crosses a restart or a process border.
#include <optional>
#include <string>

#include "pipeline/tile/tile_mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

proto::TileMeshRecord record_of_mesh(const proto::TileMesh& mesh);
/// nullopt: it is none.
std::optional<proto::TileMesh> mesh_of_record(const proto::TileMeshRecord& record);

std::string to_bytes(const BuiltTile& tile);
proto::Result<BuiltTile> tile_from_bytes(const proto::TileAddress& tile, const std::string& bytes);

}  // namespace cordillera::pipeline
