#pragma once
// Triangles of a parent against the finest samples that a finer surface left uncovered: as gpu/measure/surface_error measures
// them, both decodings.
#include <array>
#include <cstdint>
#include <vector>

#include "gpu/measure/surface_error_triangle.h"
#include "gpu/refine/refine.h"
#include "proto/lattice.h"

namespace cordillera::pipeline {

class LooseSamples {
 public:
  /// side: of the tile, units. ecef_steps: of its level.
  LooseSamples(const proto::Lattice& lattice, const proto::TileAddress& tile, std::int32_t side, const gpu::EcefSteps& ecef_steps,
               std::vector<gpu::MeshPoint> samples);

  struct Farthest {
    double error_m = 0;     ///< of all that the triangle may show
    gpu::MeshPoint inside;  ///< the farthest that could become a vertex of it
    double inside_m = -1;   ///< less than 0: there is none
  };
  Farthest farthest(const std::array<gpu::MeshPoint, 3>& corners) const;
  std::size_t size() const { return samples_.size(); }

 private:
  // A box around samples first .. last - 1; below it two halves, or nothing. Halves lie one after the other.
  struct Box {
    std::int32_t west = 0, south = 0, east = 0, north = 0;
    std::uint32_t first = 0, last = 0, halves = 0;
  };
  void divide(std::uint32_t box);
  gpu::Corner corner(const gpu::MeshPoint& p) const;
  void see(const gpu::MeasuredTriangle& triangle, double graze_m, const std::array<gpu::MeshPoint, 3>& corners,
           const gpu::MeshPoint& p, Farthest& found) const;

  const proto::Lattice& lattice_;
  std::int64_t west_, south_;
  gpu::TileFacts tile_;
  std::vector<gpu::MeshPoint> samples_;
  std::vector<Box> boxes_;
};

}  // namespace cordillera::pipeline
