#pragma once
// layer.json: what a terrain provider asks for first.
#include <string>

#include "pipeline/faces/terrain.h"

namespace cordillera::pipeline::faces {

std::string layer_json(const Terrain& terrain);

/// The tiles of one level that has_quantized_tile says yes to, as rectangles that do not overlap.
struct TileRange {
  std::int32_t start_x = 0, start_y = 0, end_x = 0, end_y = 0;  ///< both ends belong to it; y from the south
};
std::vector<TileRange> quantized_ranges(const StoreReader& store, int z);

}  // namespace cordillera::pipeline::faces
