#pragma once
#include "pipeline/faces/face.h"

namespace cordillera::pipeline::faces {

/// Raw Draco meshes on the lattice, as encode_drc made them.
const Face& draco_tiles();

}  // namespace cordillera::pipeline::faces
