#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// The surface of quantized_mesh as CesiumJS' experimental 3D Tiles terrain provider wants it.
const Face& terrain_tileset();

}  // namespace cordillera::pipeline::faces
