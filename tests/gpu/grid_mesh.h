#pragma once
// Regular meshes to begin with.
#include <cstdint>
#include <span>

#include "proto/mesh.h"

namespace cordillera::gpu {

/// The regular mesh of (side+1)^2 vertices in which every inner vertex has I(v) = 6 triangles; triangle diagonals run SW-NE.
/// x and y are multiples of step (units); heights row-major from the south-west, kNoHeight where void; the four corners are
/// kKeep.
inline proto::TileMesh grid_mesh(std::int32_t cells, std::int32_t step, std::span<const std::int32_t> heights) {
  const std::int32_t across = cells + 1;
  const std::size_t count = static_cast<std::size_t>(across) * across;
  proto::TileMesh mesh;
  mesh.side = cells * step;
  mesh.x.resize(count);
  mesh.y.resize(count);
  mesh.height.resize(count);
  mesh.mark.assign(count, 0);
  mesh.triangles.reserve(2 * static_cast<std::size_t>(cells) * cells);
  for (std::int32_t j = 0; j < across; ++j) {
    for (std::int32_t i = 0; i < across; ++i) {
      const std::size_t v = static_cast<std::size_t>(j) * across + i;
      const bool none = heights[v] == proto::kNoHeight;
      const bool corner = (i == 0 || i == cells) && (j == 0 || j == cells);
      mesh.x[v] = i * step;
      mesh.y[v] = j * step;
      mesh.height[v] = none ? 0 : heights[v];
      mesh.mark[v] = static_cast<std::uint8_t>((none ? proto::kVoid : 0) | (corner ? proto::kKeep : 0));
      if (i == cells || j == cells) continue;
      const auto sw = static_cast<std::uint32_t>(v), se = sw + 1, nw = sw + static_cast<std::uint32_t>(across), ne = nw + 1;
      mesh.triangles.push_back({sw, se, ne});
      mesh.triangles.push_back({sw, ne, nw});
    }
  }
  return mesh;
}

}  // namespace cordillera::gpu
