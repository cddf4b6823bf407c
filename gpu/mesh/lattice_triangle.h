#pragma once
// A triangle of the lattice's own surface as points of a mesh.
#include <array>
#include <cstdint>

#include "gpu/mesh/mesh_point.h"
#include "proto/cell_triangle.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// In the cell whose south-western corner is (west, south), the triangle at a place (x, y), both 0 to 1, counter-clockwise.
/// height(i, j): of a sample, kNoHeight where there is none.
template <class Height>
std::array<MeshPoint, 3> lattice_triangle(std::int32_t west, std::int32_t south, double x, double y, const Height& height) {
  const bool south_west_is_void = height(west, south) == proto::kNoHeight,
             north_east_is_void = height(west + 1, south + 1) == proto::kNoHeight;
  const auto around = proto::triangle_around(x, y, south_west_is_void, north_east_is_void);
  std::array<MeshPoint, 3> triangle;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t i = west + static_cast<std::int32_t>(around[k].east),
                       j = south + static_cast<std::int32_t>(around[k].north);
    triangle[k] = {i, j, height(i, j)};
  }
  return triangle;
}

}  // namespace cordillera::gpu
