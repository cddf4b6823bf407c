#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// Pictures for maps, transparent where there is no data: height as colour under shaded relief; height as colour alone; degrees
/// of slope; the direction that a slope faces. Their TileJSON lists the stops of the colours.
const Face& relief();
const Face& color_relief();
const Face& slope();
const Face& aspect();

}  // namespace cordillera::pipeline::faces
