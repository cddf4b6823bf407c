#pragma once
// The driver, written once (driver.inl) in steps over arrays; cleap_host.cpp and cleap_cuda.cu instantiate it with the devices of
// gpu/fit (see fit/fitter.h for what a device does).
#include <memory>
#include <string>
#include <vector>

#include "gpu/cleap/cleap.h"
#include "gpu/cleap/structure.h"

namespace cordillera::gpu::cleap {

struct Outcome {
  Simplified result;
  bool crowded_edge = false;  ///< the mesh has an edge of three triangles, and there is no result
};

/// What a tile's vertices bring along: of the input, then of the result.
struct TileTags {
  std::vector<Tag> tags;
  double rim_units = 0;  ///< that rims may move
};

class Engine {
 public:
  virtual ~Engine() = default;
  /// A mesh and options that were checked.
  virtual Outcome simplify(const fit::HeightMesh& mesh, const CollapseTarget& target, const Options& options) = 0;
  /// Triangles turn counter-clockwise. The metric is the tiles' own (half_edge.h), and so is what may happen on the border; it
  /// goes on until options.most_cost, or what is left of the passes, stops it.
  virtual Outcome simplify_tile(const fit::HeightMesh& mesh, TileTags& tile, const Options& options) = 0;
  virtual std::string device() const = 0;
  virtual fit::HeightMesh smooth(const fit::HeightMesh& mesh, std::uint32_t steps, double lambda, double mu) = 0;
};

std::unique_ptr<Engine> make_host_engine(unsigned threads);
/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<Engine>> make_cuda_engine(int device);

}  // namespace cordillera::gpu::cleap
