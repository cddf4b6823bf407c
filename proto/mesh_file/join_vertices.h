#pragma once
// Meshes whose triangles share no vertices, as many exporters write them, and those with a vertex for each normal or texture
// coordinate.
#include <optional>

#include "proto/mesh_file/triangle_mesh.h"

namespace cordillera::proto {

/// The mesh with one vertex where it has several of equal x, y and z. Vertices stay in the order of the first of each, and
/// triangles in theirs. nullopt: it has no two. mesh: finite coordinates, indices in range.
std::optional<TriangleMesh> joined_vertices(const TriangleMesh& mesh);

}  // namespace cordillera::proto
