#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// 3D Tiles 1.1: two implicit quadtrees of binary glTF with Draco.
const Face& tileset_3d();

}  // namespace cordillera::pipeline::faces
