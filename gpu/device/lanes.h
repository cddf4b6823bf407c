#pragma once
// Threads that work on one thing together, as steps see them: where each stands among them, in rows and columns, and what they
// know together. A GPU's are in warp_lanes.cuh.
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu {

/// A host's thread, alone.
struct OneLane {
  CORDILLERA_HD int index() const { return 0; }
  CORDILLERA_HD int row() const { return 0; }
  CORDILLERA_HD int rows() const { return 1; }
  CORDILLERA_HD int column() const { return 0; }
  CORDILLERA_HD int columns() const { return 1; }
  CORDILLERA_HD std::uint64_t sum(std::uint64_t value) const { return value; }
  CORDILLERA_HD std::uint64_t max(std::uint64_t value) const { return value; }
};

}  // namespace cordillera::gpu
