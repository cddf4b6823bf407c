#pragma once
// The algorithm of the thesis *Parallel Mesh Simplification on a GPU* (Universidad de Chile), chapter 4, on the CPU and on CUDA,
// and what its section 6.2 would try next, each an option. README.md says what is where, and which readings were taken.
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "gpu/cleap/candidate.h"
#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::gpu::cleap {

/// Which edges are tried, and in which order (section 4.3).
enum class Selection {
  sort,               ///< the cheapest by a sort, as published
  histogram,          ///< the cheapest by a threshold, within a sixteenth of the cost
  unsorted,           ///< all; costs are not looked at (Franc and Skala)
  vertex_best,        ///< those that are the cheapest at both their ends (Grund, Cellier)
  super_independent,  ///< one each of vertices that are three edges apart (Papageorgiou and Platis)
};
enum class Shuffle {
  fisher_yates,  ///< Algorithm 4, on the host
  keyed,         ///< a permutation that every place computes for itself
  none,
};
enum class Lock { ordered, raced };             ///< see lock_down.h
enum class Order { lock_first, test_first };    ///< as published, or only what passed the tests asks for locks
enum class Repair { everywhere, around };       ///< over all arrays as published, or what a collapse touched
enum class Rearrange { scan, pointers };        ///< see rearrange.h
enum class Delaunay { none, at_end, between };  ///< flips: never, before the output, after every pass

/// Down to where: one of them.
struct CollapseTarget {
  std::uint64_t collapses = 0;
  std::uint64_t triangles = 0;  ///< with no collapses: go on until there are no more
};

struct Options {
  std::string metric = "qem";  ///< a name of metrics.h
  Selection selection = Selection::sort;
  Shuffle shuffle = Shuffle::fisher_yates;
  Lock lock = Lock::ordered;
  Order order = Order::lock_first;
  Repair repair = Repair::everywhere;
  Rearrange rearrange = Rearrange::scan;
  Delaunay delaunay = Delaunay::none;
  Border border = Border::keep;
  Inversion inversion = Inversion::sign;
  double pool = 0.8;           ///< share of the edges that are tried, above 0 to 1; published: 0.05 to 0.8
  std::uint32_t window = 512;  ///< candidates at the same time; 0: the whole pool. 1: one after the other (`sequential`)
  std::uint64_t seed = 1;
  std::int32_t most_triangles = 14;  ///< c: at a vertex that a collapse makes
  bool come_back = false;            ///< those that lost the lock-down are tried again in the next window
  bool closing = false;              ///< what a collapse touched is left alone until the next pass (Shontz and Nistor)
  double most_cost = std::numeric_limits<double>::infinity();  ///< edges that cost more are not tried, where costs are looked at
  double idle_share = 0;  ///< a pass that collapses no larger share of the vertices is the last
  std::uint64_t around_first =
      0;  ///< with Repair::everywhere: so many collapses are repaired around, for measurements that begin in the middle
  std::uint32_t most_passes = 100;  ///< when a pool is used up the costs are found anew; published: 1
  std::string device = "auto";      ///< as in fit::MeshOptions
  unsigned threads = 1;             ///< likewise
  bool time_phases = true;          ///< stages of the report; costs some time on a GPU with small windows
  bool each_window = false;         ///< the report's list of windows
  std::function<void(std::uint64_t done, std::uint64_t all)> progress;  ///< collapses; now and then
};

struct Report {
  std::uint64_t vertices = 0, triangles = 0;    ///< of the result
  std::uint64_t collapses = 0, iterations = 0;  ///< an iteration is a window
  std::uint64_t passes = 0;
  std::array<std::uint64_t, kFates> fates{};    ///< indexed by Fate: what became of all candidates
  std::vector<std::uint32_t> window_collapses;  ///< of each iteration, if asked for
  std::string device;
  double build_seconds = 0;      ///< the arrays, once a pass
  double select_seconds = 0;     ///< costs, sort, shuffle
  double collapse_seconds = 0;   ///< the windows: the published "algorithm time" without the sort
  double rearrange_seconds = 0;  ///< vertices, triangles and edges without gaps
  double refine_seconds = 0;     ///< flips
  double copy_seconds = 0;       ///< mesh to the device and back
  double seconds() const {
    return build_seconds + select_seconds + collapse_seconds + rearrange_seconds + refine_seconds + copy_seconds;
  }
  std::vector<proto::StageTime> phases;  ///< what collapse_seconds went into, if asked for

  std::uint64_t tried() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t count : fates) sum += count;
    return sum;
  }
};

struct Simplified {
  fit::HeightMesh mesh;  ///< triangles turn as in the input; their order is the input's, of vertices that of section 4.7.1
  Report report;
};

/// What a fate is called in reports.
const char* name_of(Fate fate);

/// Metrics as (name, help), in the order of metrics.h.
std::vector<std::pair<std::string, std::string>> metrics();

/// Same input and options, same result, on every device and with any number of threads; not with Lock::raced. If the target
/// cannot be reached, the report says how far it got. Refuses what fit::simplify() refuses in a mesh ("mesh-broken",
/// "mesh-not-finite", "mesh-not-height-field", "mesh-not-manifold"), more than 2^29 triangles ("mesh-broken"), a device, and an
/// option out of range ("option-invalid").
proto::Result<Simplified> simplify(const fit::HeightMesh& mesh, const CollapseTarget& target, const Options& options = {});

/// Taubin's smoothing (section 2.1.1) as an operation of its own: steps times a step of lambda towards the neighbours' mean and
/// one of mu away from it. The border stays. Triangles are not kept from turning over.
proto::Result<fit::HeightMesh> smooth(const fit::HeightMesh& mesh, std::uint32_t steps, const std::string& device = "cpu",
                                      unsigned threads = 1, double lambda = 0.5, double mu = -0.53);

}  // namespace cordillera::gpu::cleap
