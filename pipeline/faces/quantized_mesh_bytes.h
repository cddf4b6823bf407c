#pragma once
// quantized-mesh 1.0 as its specification lays it out (CesiumGS/quantized-mesh), with the oct-encoded normals of extension 1.
#include <string>

#include "pipeline/faces/quantized_mesh_surface.h"

namespace cordillera::pipeline::faces {

std::string quantized_mesh_bytes(const QuantizedSurface& surface);

}  // namespace cordillera::pipeline::faces
