#pragma once
// The driver of the fit, written once, in steps over arrays; a Device runs the steps:
//   use()                                        the calling thread works with it
//   Array<T>                                     its memory. reserve(n), data()
//   copy_in(to, from, n), copy_out(to, from, n)  copy_out returns when the values are there
//   zero(to, n)
//   each(n, f)                                   f(i) for i in 0..n-1, in any order
//   select(n, keep, to)                          the i in 0..n-1 with keep(i), ascending; returns how many
//   exclusive_sum(from, to, n)
//   name()
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/fit/plan.h"
#include "gpu/fit/recipe.h"

namespace cordillera::gpu::fit {

/// What is left, in the plan's units.
struct FittedMesh {
  enum class Fault : std::uint8_t { none, not_manifold, overlap };
  Fault fault = Fault::none;
  std::uint32_t fault_sample = 0;  ///< of an overlap
  std::vector<Point> at;
  std::vector<float> z;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<float> error;  ///< indexed by sample, scaled: surface minus sample; 0 where missing
};

struct FitRequest {
  std::uint64_t triangles = 0;
  bool by_error = false;  ///< instead of by count
  float error = 0;        ///< then the greatest, scaled
  Recipe recipe;
};

class FitEngine {
 public:
  virtual ~FitEngine() = default;
  virtual FittedMesh fit(const Plan& plan, const FitRequest& request) = 0;
  virtual std::string device() const = 0;
  virtual const std::vector<MeshStage>& stages() const = 0;  ///< of the last call
};

std::unique_ptr<FitEngine> make_host_fit();
/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int device);

}  // namespace cordillera::gpu::fit
