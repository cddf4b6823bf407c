#pragma once
// What may be asked of a mesh that is extracted from a dataset: query parameters of mesh.glb and options of `cordillera export`.
#include <vector>

#include "pipeline/exports/mesh/mesh_request.h"
#include "server/options/options.h"
#include "server/options/table_reader.h"

namespace cordillera::server {

using MeshOption = OptionOf<pipeline::exports::MeshRequest>;
const std::vector<MeshOption>& mesh_options();

/// Triangles of one answer over HTTP: some 20 MB as .glb. The command line has a limit of its own, which its user may raise.
inline constexpr std::uint64_t kMostTrianglesOverHttp = 1'000'000;

/// What the names and values ask for. A tile is a place of its own: no level and no box go with it.
proto::Result<pipeline::exports::MeshRequest> mesh_request(const Given& given, Spelling spelling);

}  // namespace cordillera::server
