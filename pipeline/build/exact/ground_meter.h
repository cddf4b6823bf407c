#pragma once
// The error of a triangle above blocks, as it will be decoded: against what is known of the samples under it.
#include <utility>

#include "gpu/exact/simplify_block.h"
#include "gpu/measure/ecef_steps.h"
#include "gpu/measure/sample_frames.h"
#include "gpu/refine/refine.h"
#include "proto/lattice.h"

namespace cordillera::pipeline {

/// What the engine sees of a ground: squares of 8 alone. Borrows it.
gpu::exact::Field field_of(const gpu::exact::Ground& ground);

/// What all meters of a ground share; borrows it, its curve too.
struct KnownGround {
  KnownGround(const proto::Lattice& lattice, const gpu::exact::Ground& of);
  const gpu::exact::Ground& ground;
  const gpu::SampleFrames frames;
};

/// Each triangle's samples are taken for itself, so this is for the few that need it. Borrows lattice and what is known.
class GroundMeter final : public gpu::ErrorMeter {
 public:
  struct At {
    const proto::Lattice* lattice = nullptr;
    proto::TileAddress tile;
    std::int32_t side = 0;  ///< of the tile, units
    gpu::EcefSteps ecef_steps;
    std::int32_t height_step = 1;  ///< of its level
  };
  GroundMeter(const At& at, const KnownGround& known);
  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const override;
  double error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance& asked) const override;
  std::optional<std::array<gpu::MeshPoint, 3>> wanted(const std::array<gpu::MeshPoint, 3>& corners,
                                                      double limit_m) const override;
  const gpu::exact::Field& field() const { return field_; }
  /// A place of the tile, in the ground's samples.
  std::pair<int, int> on_ground(std::int32_t x, std::int32_t y) const {
    return {static_cast<int>(west_ + x), static_cast<int>(south_ + y)};
  }

 private:
  /// Around the corners, and how far samples may be from them.
  struct Known {
    proto::Samples samples;
    gpu::SampleFrames frames;
    double error_m = 0;
  };
  Known around(const std::array<gpu::MeshPoint, 3>& corners) const;
  /// What `ask` gets from a meter of these samples.
  template <class Ask>
  auto with_samples(const std::array<gpu::MeshPoint, 3>& corners, const Known& known, const Ask& ask) const;

  At at_;
  const gpu::exact::Ground& ground_;
  const gpu::SampleFrames& frames_;
  gpu::exact::Field field_;
  std::int64_t west_, south_;  ///< of the tile, in the ground's samples
};

}  // namespace cordillera::pipeline
