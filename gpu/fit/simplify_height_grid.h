#pragma once
// The simplifier of simplify_height_mesh.h for regular grids of heights. Nothing is to be looked up or sorted: a grid that
// already lies on the device that simplifies costs a fraction of a millisecond to take in. The result is, bit for bit, that of
// the mesh with two triangles in every cell, parted from its south-west to its north-east corner.
#include <memory>

#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::gpu::fit {

struct HeightGrid {
  /// columns * rows heights, row by row from the south-west corner; finite. Read by simplify() only.
  const float* z = nullptr;
  bool on_device = false;               ///< z is memory of the device that simplifies, and what writes it has been waited for
  std::uint32_t columns = 0, rows = 0;  ///< at least 2 each, at most 2^28 samples
  double x0 = 0, y0 = 0;                ///< of the first sample
  double cell_x = 1, cell_y = 1;        ///< > 0
};

class FitEngine;

/// Keeps the memory that it took from one call to the next. One thread at a time.
class GridSimplifier {
 public:
  /// As MeshOptions has it: "auto", "cpu", "cuda", "cuda:N"; threads of a CPU.
  static proto::Result<GridSimplifier> make(const std::string& device, unsigned threads = 1);
  GridSimplifier(GridSimplifier&&) noexcept;
  GridSimplifier& operator=(GridSimplifier&&) noexcept;
  ~GridSimplifier();

  /// Copies the heights to the device; they stay valid until the next call or the end of this object.
  HeightGrid keep(const HeightGrid& grid);

  /// device and threads of the options do not count here. report.stages: "load", "drops", "waves", ... on the device's own clock,
  /// then "pack" (the result as arrays, still there) and "fetch" (copied to the host); report.seconds is the sum without "fetch".
  /// Refused: a grid without cells or with too many ("grid-broken"), NaN or infinity ("grid-not-finite"), a target out of range.
  /// A GPU that fails throws DeviceLost (gpu/device/device_lost.h).
  proto::Result<SimplifiedMesh> simplify(const HeightGrid& grid, const MeshTarget& target, const MeshOptions& options = {});

 private:
  explicit GridSimplifier(std::unique_ptr<FitEngine> engine);
  std::unique_ptr<FitEngine> engine_;
};

}  // namespace cordillera::gpu::fit
