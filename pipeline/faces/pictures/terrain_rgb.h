#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// Heights above the geoid in steps of 0.1 m, as Mapbox made them common: PNG, and lossless WebP under the same addresses.
const Face& terrain_rgb();
const Face& terrain_rgb_webp();

}  // namespace cordillera::pipeline::faces
