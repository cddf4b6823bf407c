#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// The same 3D Tiles for clients that do not know implicit tiling: every tile is written down, a few levels a file.
const Face& tileset_explicit();

}  // namespace cordillera::pipeline::faces
