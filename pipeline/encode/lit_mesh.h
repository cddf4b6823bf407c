#pragma once
// The tile as a 3-D engine sees it: earth-centred points, normals, skirts. Everything that encode_glb writes and regions must
// contain.
#include <array>
#include <vector>

#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {

struct LitMesh {
  struct Surface {
    std::vector<proto::Vec3> points;            ///< ECEF metres, exact multiples of step_m: what a client decodes
    std::vector<proto::Vec3> normals;           ///< unit, indexed by point; with Normals::texture the ellipsoid's,
                                                ///< none with Normals::none
    std::vector<proto::Vec3> east;              ///< unit, indexed by point; only with Normals::texture
    std::vector<std::array<double, 2>> places;  ///< shares of the tile's longitudes eastward and of its latitudes northward;
                                                ///< where the tile has a picture
    std::vector<Triangle> triangles;
  };
  Surface terrain;
  Surface skirts;  ///< empty when the depth is 0 or no data reaches a side; its upper points repeat the terrain's
  double step_m = 0;
  proto::Vec3 translation;  ///< multiple of step_m, in the middle of all points
  int bits = 0;             ///< of the quantisation that holds every point exactly
};

/// published: of the input's mesh. terrain is empty when nothing of the tile is published. Throws std::invalid_argument when the
/// tile spans more than 2^23 steps.
LitMesh lit_mesh(const EncodeInput& input, const PublishedMesh& published);

}  // namespace cordillera::pipeline
