#pragma once
// Heights above the geoid as pixels: PNG, and lossless WebP of the same pixels.
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// In steps of 0.1 m, as Mapbox made them common.
const Face& terrain_rgb();
const Face& terrain_rgb_webp();

/// In steps of 1/256 m, as Mapzen made them common.
const Face& terrarium();
const Face& terrarium_webp();

}  // namespace cordillera::pipeline::faces
