#pragma once
// The collapse of a vertex found with all of its ring at a time, on a host.
#include "gpu/exact/steps/collapse.h"

namespace cordillera::gpu::exact {

/// What `evaluate` does with AloneLane, to the last bit.
void evaluate_whole_ring(const WindowView& w, int u);

}  // namespace cordillera::gpu::exact
