#pragma once
// The driver, written once (driver.inl) in steps over arrays; cleap_host.cpp and cleap_cuda.cu instantiate it with the devices of
// gpu/fit (see fit/fitter.h for what a device does).
#include <memory>
#include <string>

#include "gpu/cleap/cleap.h"

namespace cordillera::gpu::cleap {

struct Outcome {
  Simplified result;
  bool crowded_edge = false;  ///< the mesh has an edge of three triangles, and there is no result
};

class Engine {
 public:
  virtual ~Engine() = default;
  /// A mesh and options that were checked.
  virtual Outcome simplify(const fit::HeightMesh& mesh, const Target& target, const Options& options) = 0;
  virtual fit::HeightMesh smooth(const fit::HeightMesh& mesh, std::uint32_t steps, double lambda, double mu) = 0;
};

std::unique_ptr<Engine> make_host_engine(unsigned threads);
/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<Engine>> make_cuda_engine(int device);

}  // namespace cordillera::gpu::cleap
