#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// Shaded relief as grey pictures, transparent where there is no data.
const Face& hillshade();

}  // namespace cordillera::pipeline::faces
