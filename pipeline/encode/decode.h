#pragma once
// What a client sees: tiles read back with Draco's own decoder. For tests, for the quickstart's check and for re-measuring
// errors.
#include <string_view>
#include <vector>

#include "pipeline/encode/draco_mesh.h"
#include "proto/ellipsoid.h"
#include "proto/result.h"

namespace cordillera::pipeline {

using DecodedDrc = LatticeMesh;

struct DecodedGlb {
  proto::Vec3 translation;           ///< ECEF, z-up
  std::vector<proto::Vec3> points;   ///< ECEF metres, translation added in double
  std::vector<proto::Vec3> normals;  ///< indexed by point; empty with Normals::none
  std::vector<Triangle> triangles;
  std::vector<proto::Vec3> skirt_points;
  std::vector<Triangle> skirt_triangles;  ///< into skirt_points
};

proto::Result<DecodedDrc> decode_drc(std::string_view bytes);
proto::Result<DecodedGlb> decode_glb(std::string_view bytes);

}  // namespace cordillera::pipeline
