#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// quantized-mesh 1.0: a surface over the whole globe, as terrain providers expect it.
const Face& quantized_mesh();

}  // namespace cordillera::pipeline::faces
