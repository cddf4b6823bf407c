#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// Heights above the geoid in steps of 1/256 m, as Mapzen made them common: PNG, and lossless WebP under the same addresses.
const Face& terrarium();
const Face& terrarium_webp();

}  // namespace cordillera::pipeline::faces
