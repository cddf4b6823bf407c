#pragma once
// Normals that neighbouring tiles agree about: on a side every tile that has triangles there counts.
#include <vector>

#include "pipeline/faces/terrain.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// Unit normals of a tile's mesh, earth-centred, indexed by its vertices.
std::vector<proto::Vec3> mesh_normals(const Terrain& terrain, const MeshIndex& mesh);

}  // namespace cordillera::pipeline::faces
