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
  Surface skirts;           ///< empty when the depth is 0 or no data reaches a side; its upper points repeat the terrain's
  double step_m = 0;        ///< the finest of a point
  proto::Vec3 translation;  ///< in the middle of all points; or of those with the finest step, a multiple of all steps
  int bits = 0;             ///< of the quantisation; see FloatGrid
};

/// published: of the input's mesh. terrain is empty when nothing of the tile is published. Throws std::invalid_argument, see
/// encode_glb.
LitMesh lit_mesh(const EncodeInput& input, const PublishedMesh& published);

}  // namespace cordillera::pipeline
