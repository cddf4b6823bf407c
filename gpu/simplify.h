#pragma once
// Strategies by name, and the simplifiers of tiles: one interface, a CPU and a CUDA backend made from the same source, the same
// bits from both.
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::gpu {

/// One tile to simplify. Borrowed for the call.
struct SimplifyJob {
  const proto::TileMesh* input = nullptr;
  /// Indexed by vertex of input: metres, the height the cost works on (ellipsoidal height minus the sag of the earth's curvature
  /// relative to the tile, so that a flat sea is seen as curved). Void vertices: any finite value.
  std::span<const float> elevation;
  float tolerance_m = 1;  ///< edges are collapsed as long as their cost is low, by its square
  float rim_units = 0;    ///< how far the rim of a hole may move, in units
  float unit_m = 1;       ///< metres a unit, about: costs are measured across as well as along the vertical
};

/// Runs work(i) for every i in 0..count-1, at the same time if it can; returns when all are done.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;
void one_after_the_other(std::size_t count, const std::function<void(std::size_t)>& work);

/// Simplifies tiles one by one. Every vertex of a result is a vertex of its input, in the input's order (half-edge collapse;
/// positions do not move). Vertices marked kKeep survive, and so does the border of the mesh: all of its vertices must be kKeep.
/// What the input covers stays exactly covered by triangles of positive area, with as many neighbours as valence_limits.h says.
class Simplifier {
 public:
  virtual ~Simplifier() = default;
  /// results[i] belongs to jobs[i]. Results do not depend on how jobs are batched.
  virtual std::vector<proto::TileMesh> simplify(std::span<const SimplifyJob> jobs) = 0;
  virtual std::string device() const = 0;  ///< "cpu" or "cuda:0 (NVIDIA …)"
};

/// How blocks and tiles are simplified, by name: the production strategy, of blocks (see gpu/exact); then the published
/// algorithm, of tiles, many edges at a time or one after the other, to be compared with (cleap/README.md).
inline constexpr const char* kExact = "exact";
inline constexpr std::array<const char*, 3> kStrategies{kExact, "cleap", "sequential"};

using MakeSimplifier = proto::Result<std::unique_ptr<Simplifier>> (*)(const std::string& device, ParallelFor parallel,
                                                                      const std::string& strategy);

/// "cleap" and "sequential" are a library of their own, which not every program has: one that has it says here, once and before
/// its first simplifier, who makes them. cleap::offer_strategies() does.
void offer_published(MakeSimplifier make);

/// A strategy that is not there ("option-invalid"), or a device that is nothing for it ("options-conflict").
std::optional<proto::Problem> check_strategy(const std::string& strategy, const std::string& device);

/// Of tiles. device: "auto", "cpu", "cuda", "cuda:N". auto takes the first CUDA device that works, else the CPU. One Simplifier a
/// thread. parallel: for what remains on the host, tile by tile; called from the thread that calls simplify(). strategy: see
/// check_strategy(); `sequential` works on the CPU alone. "option-invalid" for exact, and for one that this program has not.
proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device, ParallelFor parallel,
                                                           const std::string& strategy);

/// How many CUDA devices this process may use; 0 where there is none, or the program was built without CUDA.
int cuda_devices();
/// False: there is no GPU. Known at once, no device is woken for it.
bool has_cuda_driver();

}  // namespace cordillera::gpu
