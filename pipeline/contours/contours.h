#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::contours {

/// Lines of equal height above the geoid as Mapbox Vector Tiles. A tile without lines does not exist.
const faces::Face& contours();

}  // namespace cordillera::pipeline::contours
