#pragma once
// Where a picture shows water, by the dataset's water masks.
#include <vector>

#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// How much of each pixel of a WebMercatorQuad tile is water, 0 to 1: that of the level's cell under its centre. By row from the
/// north, then column. Empty where the dataset does not say where water is.
std::vector<float> water_pixels(const Terrain& terrain, const Place& place, int level);

}  // namespace cordillera::pipeline::faces
