#pragma once
#include <string>

#include "pipeline/faces/quantized_mesh/quantized_mesh_surface.h"

namespace cordillera::pipeline::faces {

/// Binary glTF of one primitive: float32 positions and normals, no skirts (the client hangs its own), the vertices of the four
/// sides as CESIUM_tile_edges. copyright: empty for none.
std::string terrain_glb(const QuantizedSurface& surface, const std::string& copyright);

}  // namespace cordillera::pipeline::faces
