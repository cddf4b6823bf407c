#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// quantized-mesh in EPSG:3857.
const Face& mercator_terrain();

}  // namespace cordillera::pipeline::faces
