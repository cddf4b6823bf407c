#pragma once
// The true errors of many tiles at once, on a device: those of surface_error(), to the last bit.
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gpu/measure/surface_error.h"
#include "gpu/simplify.h"

namespace cordillera::gpu {

/// A tile to measure. Borrowed for the call.
struct TileSurface {
  proto::TileAddress tile;
  const proto::TileMesh* mesh = nullptr;
};

/// Measures tiles against samples that stay on the device from call to call. One BatchMeter a thread. A GPU that fails or has no
/// memory left is a DeviceLost, thrown.
class BatchMeter {
 public:
  virtual ~BatchMeter() = default;
  /// What all tiles are measured against from now on; see SurfaceErrorInput. Copied to the device; the samples themselves are
  /// borrowed as long as tiles are measured.
  virtual void keep(const proto::Lattice& lattice, const proto::Samples& samples, double ecef_step_m) = 0;
  /// results[i] is surface_error() of tiles[i] without `over_limit`, which is left empty. A tile some of whose published vertices
  /// lie outside the window of the samples is measured on the host.
  virtual std::vector<SurfaceError> measure(std::span<const TileSurface> tiles) = 0;
  virtual std::string device() const = 0;  ///< "cpu" or "cuda:0 (NVIDIA …)"
  /// What the last call spent its time on; for benches.
  virtual std::span<const proto::StageTime> stages() const = 0;
};

/// Devices as in make_simplifier. parallel: for what remains on the host, tile by tile.
proto::Result<std::unique_ptr<BatchMeter>> make_batch_meter(const std::string& device,
                                                            ParallelFor parallel = one_after_the_other);

}  // namespace cordillera::gpu
