#pragma once
// Every tile of a dataset, depth first: memory does not grow with the dataset.
#include <functional>

#include "pipeline/store/store.h"

namespace cordillera::pipeline::faces {

/// Nodes that have triangles themselves or below them, parents before their children.
void walk_tiles(const StoreReader& store, const std::function<void(const TileExtent&)>& visit);

}  // namespace cordillera::pipeline::faces
