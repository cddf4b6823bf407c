#pragma once
// What is known of the triangles of a tile whose mesh changes here and there.
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "gpu/measure/surface_error_triangle.h"
#include "gpu/mesh/mesh_point.h"

namespace cordillera::gpu {

/// What is counted and summed of some triangles.
struct SurfaceSums {
  std::uint64_t covered = 0, summed = 0, overcovered = 0;
  SquareSum squares;
  void add(const SurfaceSums& other) {
    covered += other.covered, summed += other.summed, overcovered += other.overcovered;
    squares.low += other.squares.low, squares.high += other.squares.high;
  }
};

/// Given to surface_error() again, it has no triangle measured again that is as it was. For one tile, its samples, its step, and
/// one limit.
struct SurfaceMemory {
  struct Triangle {
    std::array<MeshPoint, 3> corners;
    unsigned owned = 0;         ///< see measured_triangle
    std::int32_t x = 0, y = 0;  ///< see SurfaceError::Worst
    double error_m = -1;        ///< its error, where that is more than floor_m
    double floor_m = INFINITY;
    SurfaceSums sums;
  };
  std::vector<Triangle> triangles;     ///< indexed by triangle
  std::optional<std::uint64_t> valid;  ///< samples of the tile
};

}  // namespace cordillera::gpu
