#pragma once
// Most neighbours of vertices of a tile that may lie beside others.
#include <cstddef>
#include <cstdint>

#include "gpu/mesh/valence_limits.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// Most neighbours of vertices with data, by place.
struct ValenceCaps {
  std::uint32_t inside, side, corner;
};
/// Of a tile that has neighbours: together with them its sides keep to the contract.
inline constexpr ValenceCaps kWeldedCaps{kMostValence, kRefinedSide, kRefinedCorner};

/// How many sides of the tile v is on: 2 at a corner.
inline int sides_of(const proto::TileMesh& mesh, std::uint32_t v) {
  return int{mesh.x[v] == 0 || mesh.x[v] == mesh.side} + int{mesh.y[v] == 0 || mesh.y[v] == mesh.side};
}

/// Most neighbours v may have; void vertices have caps of their own.
inline std::uint32_t most_neighbours(const proto::TileMesh& mesh, std::uint32_t v, const ValenceCaps& caps) {
  const int sides = sides_of(mesh, v);
  if (is_void(mesh, v)) return sides == 0 ? kVoidInside : sides == 1 ? kVoidSide : kVoidCorner;
  return sides == 0 ? caps.inside : sides == 1 ? caps.side : caps.corner;
}
/// May v have so many neighbours in such a tile?
inline bool may_have(const proto::TileMesh& mesh, std::uint32_t v, std::size_t neighbours) {
  return neighbours <= most_neighbours(mesh, v, kWeldedCaps);
}

}  // namespace cordillera::gpu
