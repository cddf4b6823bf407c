#pragma once
// layer.json: what a terrain provider asks for first.
#include <functional>
#include <string>
#include <vector>

#include "pipeline/faces/quantized_mesh/mesh_grid.h"

namespace cordillera::pipeline::faces {

/// projection: as the format has it. Tiles are at terrain/{z}/{x}/{y}.terrain beside the document.
std::string layer_json(const MeshGrid& grid, const std::string& projection);

/// The tiles of one z that has_quantized_tile says yes to, as rectangles that do not overlap.
std::vector<TileRange> quantized_ranges(const MeshGrid& grid, int z);

/// All of them, those of one z and of every z; rows from the south, columns from the west in each rectangle.
using TileVisitor = std::function<void(const proto::TileAddress& tile)>;
void each_quantized_tile(const MeshGrid& grid, int z, const TileVisitor& visit);
void each_quantized_tile(const MeshGrid& grid, const TileVisitor& visit);

}  // namespace cordillera::pipeline::faces
