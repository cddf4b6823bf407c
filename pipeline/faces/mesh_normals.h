#pragma once
// Normals that neighbouring tiles agree on: at a vertex of a common side all tiles there add to them.
#include <vector>

#include "pipeline/encode/encode.h"
#include "pipeline/faces/terrain.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// Unit normals of a tile's mesh, earth-centred, indexed by its vertices.
std::vector<proto::Vec3> mesh_normals(const Terrain& terrain, const MeshIndex& mesh);

/// The sums at the vertices of its sides, but for those on the side of its block: blocks are made at different times, and a tile
/// is to be the same as soon as its own is. The same bits from every tile there.
SideNormals side_normals(const Terrain& terrain, const MeshIndex& mesh);

}  // namespace cordillera::pipeline::faces
