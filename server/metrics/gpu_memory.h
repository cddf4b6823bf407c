#pragma once
// How full the GPUs are, asked of the driver's own library: no context is made, which would take memory of theirs.
#include <cstdint>
#include <string>
#include <vector>

namespace cordillera::server::metrics {

struct Gpu {
  std::string name;
  std::string driver;
  std::uint64_t total = 0;  ///< bytes
  std::uint64_t used = 0;
};

/// None where there is no driver. The library is looked for once.
std::vector<Gpu> gpus();

}  // namespace cordillera::server::metrics
