#pragma once
// What clients cull a tile by: a sphere around it, and a point that is behind the horizon only if all of it is.
#include <vector>

#include "pipeline/faces/quantized_mesh/quantized_mesh_surface.h"

namespace cordillera::pipeline::faces {

struct QuantizedBounds {
  double low_m = 0, high_m = 0;  ///< of the vertices
  proto::Vec3 centre;            ///< of the tile and of the sphere
  double radius_m = 0;           ///< holds every triangle
  proto::Vec3 horizon;           ///< in the space in which the ellipsoid is a sphere of radius 1
};

/// Earth-centred positions of the vertices, as a client has them.
std::vector<proto::Vec3> positions(const QuantizedSurface& surface);
QuantizedBounds quantized_bounds(const QuantizedSurface& surface, const std::vector<proto::Vec3>& positions);

}  // namespace cordillera::pipeline::faces
