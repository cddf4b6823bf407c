#pragma once
// The published algorithm as a strategy of tiles: between sides that stay, with everything before and after it as it is.
#include <memory>
#include <string>

#include "gpu/simplify.h"

namespace cordillera::gpu::cleap {

/// strategy: "cleap" or "sequential", which needs no GPU.
proto::Result<std::unique_ptr<Simplifier>> make_tile_simplifier(const std::string& device, ParallelFor parallel,
                                                                const std::string& strategy);

/// From here on gpu::make_simplifier makes both.
void offer_strategies();

}  // namespace cordillera::gpu::cleap
