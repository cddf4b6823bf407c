#pragma once
#include <stdexcept>

namespace cordillera::gpu {

/// The GPU failed in mid-work (an error or out of device memory). The caller repeats the work on the CPU: same bytes.
class DeviceLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace cordillera::gpu
