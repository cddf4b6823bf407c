#pragma once
// The triangles of many tiles measured at once, on a GPU.
#include <memory>
#include <span>
#include <string>

#include "gpu/measure/surface_error.h"
#include "proto/result.h"

namespace cordillera::gpu {

/// One call at a time, on the caller's thread; the memory that it has on the device stays for the next. A GPU that fails or has
/// no memory left is a DeviceLost, thrown.
class BatchMeter {
 public:
  virtual ~BatchMeter() = default;
  /// Fills memories[k] with what surface_error() would find of the triangles of tiles[k]: given to it afterwards, it has next to
  /// nothing left to measure, and says the same, to the last bit. Left for it are triangles over limit_m (a host finds the
  /// worst place in them), those with corners beyond the samples, and the largest, for which a host's vectors are quicker.
  /// tiles: all of the same samples. memories: empty, as many.
  virtual void measure(std::span<const SurfaceErrorInput> tiles, double limit_m, std::span<SurfaceMemory> memories) = 0;
};

/// "cuda", "cuda:N"; "device-unavailable", with the reason, where it cannot be used.
proto::Result<std::unique_ptr<BatchMeter>> make_batch_meter(const std::string& device);
/// The same steps on the host. surface_error() is quicker: this is for tests.
std::unique_ptr<BatchMeter> make_host_batch_meter();

}  // namespace cordillera::gpu
