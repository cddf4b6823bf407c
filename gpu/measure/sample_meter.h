#pragma once
// The error of a triangle against the finest samples, for refinement.
#include "gpu/measure/surface_meter.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// As surface_error measures it, both decodings; the point that helps is the worst sample inside or, of a needle without any, one
/// beside its worst corner. Beside a pole, columns about as far apart as rows are offered first. Borrows what input points to.
class SampleMeter final : public ErrorMeter {
 public:
  /// height_step: no corner is farther than that beyond the samples and the mesh, in kHeightStep_m.
  explicit SampleMeter(const SurfaceErrorInput& input, std::int32_t height_step = 1);
  TriangleError measure(const std::array<MeshPoint, 3>& corners, double limit_m) const override;
  double error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const override;
  /// At the worst sample, towards the triangle's middle. None beside a pole.
  std::optional<std::array<MeshPoint, 3>> wanted(const std::array<MeshPoint, 3>& corners, double limit_m) const override;

 private:
  MeasuredTriangle triangle(const std::array<MeshPoint, 3>& corners) const;
  /// As far apart in space as rows are, or half of that: a power of two.
  std::int64_t columns_apart(std::int64_t y) const;
  /// The one at that point into which that direction leads.
  std::optional<std::array<MeshPoint, 3>> lattice_triangle(std::int32_t x, std::int32_t y, std::int64_t east,
                                                           std::int64_t north) const;

  SurfaceMeter meter_;
  std::int64_t side_;
  proto::Lattice lattice_;
  std::int64_t south_;
};

}  // namespace cordillera::gpu
