#pragma once
// The steps of the driver (see fitter.h) on the CPU: one thread, plain loops.
#include <cstddef>
#include <string>

#include "gpu/host_steps.h"

namespace cordillera::gpu::fit {

/// The team of a host.
struct OneThread {
  template <class F>
  void each(std::size_t n, const F& f) {
    for (std::size_t i = 0; i < n; ++i) f(i);
  }
  void barrier() {}
};

class HostSteps : public gpu::HostSteps {
 public:
  /// f(team, block): a team works together on a block, in steps with barriers between.
  template <class F>
  void each_block(std::size_t blocks, const F& f) {
    OneThread team;
    for (std::size_t i = 0; i < blocks; ++i) f(team, i);
  }

  void use() {}
  std::string name() const { return "cpu"; }
};

}  // namespace cordillera::gpu::fit
