// Which CUDA devices there are.
#include <cuda_runtime.h>

#include "gpu/simplify.h"

namespace cordillera::gpu {

bool has_cuda_driver() {
  int version = 0;
  return cudaDriverGetVersion(&version) == cudaSuccess && version > 0;
}

int cuda_devices() {
  int count = 0;
  return cudaGetDeviceCount(&count) == cudaSuccess ? count : 0;
}

}  // namespace cordillera::gpu
