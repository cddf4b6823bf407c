#pragma once
// A finished mesh on its way to the levels above, in bytes: what crosses a restart or a process border.
#include <optional>

#include "cordillera.pb.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

proto::TileMeshRecord record_of_mesh(const proto::TileMesh& mesh);
/// nullopt: it is none.
std::optional<proto::TileMesh> mesh_of_record(const proto::TileMeshRecord& record);

}  // namespace cordillera::pipeline
