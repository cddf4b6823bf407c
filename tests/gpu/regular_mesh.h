#pragma once
// A mesh of a block that no simplifier made.
#include <cstdint>

#include "gpu/exact/simplify_block.h"

namespace cordillera::gpu::exact {

/// A vertex every so many samples, row by row, all of one height and none of them void.
inline BlockMesh regular_mesh(std::int32_t columns, std::int32_t rows, std::int32_t step, std::int32_t height) {
  const auto across = static_cast<std::uint32_t>((columns - 1) / step), up = static_cast<std::uint32_t>((rows - 1) / step);
  BlockMesh mesh;
  for (std::uint32_t y = 0; y <= up; ++y) {
    for (std::uint32_t x = 0; x <= across; ++x) {
      mesh.x.push_back(static_cast<std::uint16_t>(x * static_cast<std::uint32_t>(step)));
      mesh.y.push_back(static_cast<std::uint16_t>(y * static_cast<std::uint32_t>(step)));
      mesh.height.push_back(height);
      mesh.is_void.push_back(0);
      const std::uint32_t at = y * (across + 1) + x;
      if (x == across || y == up) continue;
      mesh.triangles.push_back({at, at + 1, at + across + 2});
      mesh.triangles.push_back({at, at + across + 2, at + across + 1});
    }
  }
  return mesh;
}

}  // namespace cordillera::gpu::exact
