#pragma once
// layer.json: what a terrain provider asks for first.
#include <string>
#include <vector>

#include "pipeline/faces/quantized_mesh/mesh_grid.h"

namespace cordillera::pipeline::faces {

/// projection: as the format has it. Tiles are at terrain/{z}/{x}/{y}.terrain beside the document.
std::string layer_json(const MeshGrid& grid, const std::string& projection);

/// The tiles of one z that has_quantized_tile says yes to, as rectangles that do not overlap.
std::vector<TileRange> quantized_ranges(const MeshGrid& grid, int z);

}  // namespace cordillera::pipeline::faces
