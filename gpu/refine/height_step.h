#pragma once
// Heights that are kept to coarser steps than kHeightStep_m: what a target in metres does not need, no tile has to carry.
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// The nearest multiple of step (1 or more); of two the higher one. Both in kHeightStep_m.
inline std::int32_t rounded_height(std::int32_t height, std::int32_t step) {
  const std::int32_t shifted = height + step / 2, past = shifted % step;
  return shifted - (past < 0 ? past + step : past);
}

/// Offers points whose heights are multiples of step. Borrows the meter, which must bear corners half a step beyond those that it
/// offers.
class SteppedMeter final : public ErrorMeter {
 public:
  SteppedMeter(const ErrorMeter& meter, std::int32_t step) : meter_(meter), step_(step) {}

  TriangleError measure(const std::array<MeshPoint, 3>& corners, double limit_m) const override {
    TriangleError error = meter_.measure(corners, limit_m);
    for (MeshPoint& p : error.points) p.height = rounded_height(p.height, step_);
    return error;
  }

  double error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const override {
    return meter_.error_m(corners, asked);
  }

  std::optional<std::array<MeshPoint, 3>> wanted(const std::array<MeshPoint, 3>& corners, double limit_m) const override {
    auto triangle = meter_.wanted(corners, limit_m);
    if (!triangle) return triangle;
    for (MeshPoint& p : *triangle) {
      if (p.height != proto::kNoHeight) p.height = rounded_height(p.height, step_);
    }
    return triangle;
  }

 private:
  const ErrorMeter& meter_;
  std::int32_t step_;
};

}  // namespace cordillera::gpu
