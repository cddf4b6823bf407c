#pragma once
// The simplifier: one interface, a CPU and a CUDA backend made from the same source, the same bits from both.
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
#include "proto/stop_watch.h"

namespace cordillera::gpu {

/// One tile to simplify. Borrowed for the call.
struct SimplifyJob {
  const proto::TileMesh* input = nullptr;
  /// Indexed by vertex of input: metres, the height the cost works on (ellipsoidal height minus the sag of the earth's curvature
  /// relative to the tile, so that a flat sea is seen as curved). Void vertices: any finite value.
  std::span<const float> elevation;
  float cell_units = 1;   ///< one cell of the tile's level, in units
  float tolerance_m = 1;  ///< collapses are taken while the quadric cost stays under tolerance_m^2 * cost_per_tolerance
  float guard_m = 0;      ///< > 0: no vertex may end up farther than this from the new surface, as far as the collapse can see
  float rim_units = 0;    ///< how far the rim of a hole may move, in units
  float unit_m = 1;       ///< metres a unit, about; for strategies that measure across as well as along the vertical
  /// > 0, input a full grid of a power of two of cells: strategy `waves` starts from a right-triangulated network of some of its
  /// vertices (see sparse_start.h). kKeep and the rims of voids are among them; where data is all around, a vertex is left out
  /// only if it lies within this of the middle of the edge that then passes over it. Vertices left out later than it add to that,
  /// so this bounds no error: results must be measured.
  float start_tolerance_m = 0;
};

/// Runs work(i) for every i in 0..count-1, at the same time if it can; returns when all are done.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& work)>;
void one_after_the_other(std::size_t count, const std::function<void(std::size_t)>& work);

/// Simplifies tiles. Every vertex of a result is a vertex of its input (half-edge collapse; positions do not move, but for a
/// border vertex that steps inside where nothing else can take it off the border). Vertices marked kKeep survive, unless they
/// stand in the way of the border; vertices marked kRemove (tile border) are gone (where one is left, its surroundings were too
/// sparse: keep some of them and ask again); the tile rectangle stays exactly covered by triangles of positive area; valence <=
/// 14 inside (a weld may leave more, which the next simplification brings down by flips), and on the tile's border at most what
/// rings.h says.
class Simplifier {
 public:
  virtual ~Simplifier() = default;
  /// results[i] belongs to jobs[i]. Results do not depend on how jobs are batched.
  virtual std::vector<proto::TileMesh> simplify(std::span<const SimplifyJob> jobs) = 0;
  virtual std::string device() const = 0;  ///< "cpu" or "cuda:0 (NVIDIA …)"
  /// What the last call spent its time on, all batches together; for benches.
  virtual std::span<const proto::StageTime> stages() const = 0;
};

/// The regular mesh of (side+1)^2 vertices in which every inner vertex has I(v) = 6 triangles; triangle diagonals run SW-NE.
/// x and y are multiples of step (units); heights row-major from the south-west, kNoHeight where void; the four corners are
/// kKeep.
proto::TileMesh grid_mesh(std::int32_t cells, std::int32_t step, std::span<const std::int32_t> heights);

/// How tiles are simplified, by name: the production strategy first; then the published algorithm, many edges at a time or one
/// after the other, to be compared with (cleap/README.md).
inline constexpr const char* kExact = "exact";  ///< of blocks, not of tiles: see gpu/exact
inline constexpr std::array<const char*, 4> kStrategies{"waves", kExact, "cleap", "sequential"};

using MakeSimplifier = proto::Result<std::unique_ptr<Simplifier>> (*)(const std::string& device, ParallelFor parallel,
                                                                      const std::string& strategy);

/// "cleap" and "sequential" are a library of their own, which not every program has: one that has it says here, once and before
/// its first simplifier, who makes them. cleap::offer_strategies() does.
void offer_published(MakeSimplifier make);

/// A strategy that is not there ("option-invalid"), or a device that is nothing for it ("options-conflict").
std::optional<proto::Problem> check_strategy(const std::string& strategy, const std::string& device);

/// "auto", "cpu", "cuda", "cuda:N". auto takes the first CUDA device that works, else the CPU. One Simplifier a thread.
/// parallel: for what remains on the host, tile by tile; called from the thread that calls simplify(). strategy: see
/// check_strategy(); `sequential` works on the CPU alone. "option-invalid" for one that this program has not.
proto::Result<std::unique_ptr<Simplifier>> make_simplifier(const std::string& device, ParallelFor parallel = one_after_the_other,
                                                           const std::string& strategy = kStrategies.front());

/// How many CUDA devices this process may use; 0 where there is none, or the program was built without CUDA.
int cuda_devices();
/// False: there is no GPU. Known at once, no device is woken for it.
bool has_cuda_driver();

}  // namespace cordillera::gpu
