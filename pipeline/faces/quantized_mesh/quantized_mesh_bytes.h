#pragma once
// quantized-mesh 1.0 as its specification lays it out (CesiumGS/quantized-mesh), with the oct-encoded normals of extension 1
// and the water mask of extension 2.
#include <string>

#include "pipeline/faces/quantized_mesh/quantized_mesh_surface.h"

namespace cordillera::pipeline::faces {

/// water: null where the dataset does not say where it is; else extension 2 follows.
std::string quantized_mesh_bytes(const QuantizedSurface& surface, const WaterPixels* water);

/// A tile that the grid has.
std::string quantized_mesh_tile(const MeshGrid& grid, const proto::TileAddress& tile);

/// A tile; nothing where the grid has none there.
proto::Result<std::optional<Document>> quantized_mesh_document(const MeshGrid& grid, const proto::TileAddress& tile);

}  // namespace cordillera::pipeline::faces
