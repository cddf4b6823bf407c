#pragma once
// Where a tile really is: 3D Tiles bounding regions that hold every decoded point and all that lies between.
#include <array>

#include "pipeline/encode/lit_mesh.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {

/// Radians and metres above the ellipsoid.
struct Geodetic {
  double longitude = 0, latitude = 0, height_m = 0;
};
/// Inverse of proto::ecef for points farther than 1,000 km from the earth's centre; good to well under a millimetre.
Geodetic geodetic(proto::Vec3 p);

/// west, south, east, north (radians), lowest, highest (metres): see tile_region in encode.h. mesh.terrain is not empty.
std::array<double, 6> region_of(const LitMesh& mesh, const proto::TileAddress& tile);

}  // namespace cordillera::pipeline
