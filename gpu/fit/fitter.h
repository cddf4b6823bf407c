#pragma once
// The driver of the fit, written once, in steps over arrays; a Device runs the steps:
//   use()                                        the calling thread works with it
//   Array<T>                                     its memory. reserve(n), data()
//   copy_in(to, from, n), copy_out(to, from, n)  copy_out returns when the values are there
//   zero(to, n)
//   each(n, f)                                   f(i) for i in 0..n-1, in any order
//   each_of(vertices, f)                         f(v), likewise
//   each_star(vertices, crowd, f)                f(lanes, v): see lanes.h. crowd: about so many samples to a vertex
//   each_edge(vertices, crowd, f)                the same for what looks at the edges of v one by one
//   each_block(n, f)                             f(team, i): see host_steps.h
//   each_counting(n, f)                          f(i), which counts by fetch_add()
//   list(vertices, keep, to)                     the vertices with keep(v), in any order; nobody waits for their number
//   split(vertices, test, yes, no)               both parts, likewise
//   value(count)                                 waits
//   select(n, keep, to)                          the i in 0..n-1 with keep(i), ascending; waits, and returns how many
//   histogram(n, class_of, bins, classes)        bins[class_of(i)] += 1, but for classes that are none
//   exclusive_sum(from, to, n)
//   sort_by_key(keys, values, n)                 both, ascending by key; keys are below 2^48
//   watch<T>().look(at)                          *at as it was a few calls ago, if there were so many; the last steps go on
//   stamp(), seconds_between(from, to), forget_stamps()   moments on its clock; the second waits
//   name()
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "gpu/fit/plan.h"
#include "gpu/fit/recipe.h"
#include "gpu/fit/simplify_height_grid.h"

namespace cordillera::gpu::fit {

/// What is left, in the plan's units.
struct FittedMesh {
  enum class Fault : std::uint8_t { none, not_manifold, overlap, not_finite };
  Fault fault = Fault::none;
  std::uint32_t fault_sample = 0;  ///< of an overlap, or not finite
  std::vector<Point> at;
  std::vector<float> z;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<float> error;  ///< indexed by sample, scaled: surface minus sample; 0 where missing
};

struct FitRequest {
  std::uint64_t triangles = 0;
  bool by_error = false;  ///< instead of by count
  double error_m = 0;     ///< then the greatest
  float error = 0;        ///< the same, scaled
  Recipe recipe;
};

class FitEngine {
 public:
  virtual ~FitEngine() = default;
  virtual FittedMesh fit(const Plan& plan, const FitRequest& request) = 0;
  /// The scale is found on the way, before an error in the request is needed.
  virtual FittedMesh fit(const HeightGrid& grid, FitRequest request, PlanScale& scale) = 0;
  virtual const float* keep(const HeightGrid& grid) = 0;
  virtual std::string device() const = 0;
  virtual const std::vector<proto::StageTime>& stages() const = 0;  ///< of the last call
};

std::unique_ptr<FitEngine> make_host_fit(unsigned threads);
/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int device);

}  // namespace cordillera::gpu::fit
