#pragma once
// The mesh as the simplifier sees it: every vertex knows its ring of neighbours, triangles are implied.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "gpu/mesh/valence_limits.h"
#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::gpu {

/// Most neighbours of vertices with data, by place.
struct ValenceCaps {
  std::uint32_t inside, side, corner;
};
/// Of a tile that will be welded.
inline constexpr ValenceCaps kWeldedCaps{kMostValence, kMendedSide, kMendedCorner};

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
/// May v have so many neighbours in a tile that will be welded?
inline bool may_have(const proto::TileMesh& mesh, std::uint32_t v, std::size_t neighbours) {
  return neighbours <= most_neighbours(mesh, v, kWeldedCaps);
}

/// Row v holds the neighbours of vertex v counter-clockwise. Closed rows (inner vertices) start at their lowest neighbour; open
/// rows (vertices on a side of the tile) start at the border neighbour from which the fan runs counter-clockwise to the other
/// one. The triangles at v are (v, r[i], r[i + 1]), and in a closed row also (v, r[last], r[0]).
struct Rings {
  std::vector<std::uint32_t> neighbour;  ///< kRowWidth a vertex; beyond valence[v]: unspecified
  std::vector<std::uint8_t> valence;     ///< indexed by vertex: neighbours in use; 0 = the vertex is not in the mesh
  std::vector<std::uint8_t> open;        ///< indexed by vertex: 1 on the border of the mesh

  std::size_t vertices() const { return valence.size(); }
  std::span<const std::uint32_t> ring(std::uint32_t v) const {
    return {neighbour.data() + static_cast<std::size_t>(v) * kRowWidth, valence[v]};
  }
  std::span<std::uint32_t> row(std::uint32_t v) {
    return {neighbour.data() + static_cast<std::size_t>(v) * kRowWidth, kRowWidth};
  }
  /// Triangles around v.
  std::uint32_t triangles_at(std::uint32_t v) const {
    return valence[v] == 0 ? 0u : static_cast<std::uint32_t>(valence[v] - open[v]);
  }
};

/// Fails with "mesh-not-manifold" when the triangles around a vertex are no single fan, when a row would be wider than kRowWidth,
/// or when a vertex is open inside the rectangle or closed on its sides. Vertices without triangles get valence 0.
proto::Result<Rings> rings_from_triangles(const proto::TileMesh& mesh);

/// Each triangle once, its lowest vertex first, ordered by that vertex and then by its ring.
std::vector<std::array<std::uint32_t, 3>> triangles_from_rings(const Rings& rings);

/// The vertices of original that still have a row, in their order, with the triangles of the rings.
proto::TileMesh mesh_from_rings(const proto::TileMesh& original, const Rings& rings);

}  // namespace cordillera::gpu
