#pragma once
#include "tests/bench/batch_meter/surface_error_batch.h"

namespace cordillera::gpu {

/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<BatchMeter>> make_cuda_batch_meter(int device, ParallelFor parallel);

}  // namespace cordillera::gpu
