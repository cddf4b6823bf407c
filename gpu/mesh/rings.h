#pragma once
// The mesh as the simplifier sees it: every vertex knows its ring of neighbours, triangles are implied.
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::gpu {

/// Most neighbours a vertex with data may have: the contract of every published tile.
inline constexpr std::uint32_t kMostValence = 14;
/// Width of a row. Void vertices, which nobody sees, may fill it: they border dense rims.
inline constexpr std::uint32_t kRowWidth = 24;
/// Most neighbours a void vertex may have inside, on a side and at a corner of a simplified tile: welded, they fit a row.
inline constexpr std::uint32_t kVoidInside = 20, kVoidSide = 13, kVoidCorner = 7;
/// The same of a vertex with data on a side and at a corner: 11 + 11 - 2 and 4 x 6 - 4, welded, fit a row too.
inline constexpr std::uint32_t kMendedSide = 11, kMendedCorner = 6;

/// Valences of vertices with data, by place.
struct ValenceCaps {
  std::uint32_t inside = 12;
  std::uint32_t side = 8;
  std::uint32_t corner = 4;
};

/// How many sides of the tile v is on: 2 at a corner.
inline int sides_of(const proto::TileMesh& mesh, std::uint32_t v) {
  return int{mesh.x[v] == 0 || mesh.x[v] == mesh.side} + int{mesh.y[v] == 0 || mesh.y[v] == mesh.side};
}

/// Most neighbours v may have; void vertices have caps of their own.
inline std::uint32_t most_neighbours(const proto::TileMesh& mesh, std::uint32_t v, const ValenceCaps& caps) {
  const int sides = sides_of(mesh, v);
  if (mesh.mark[v] & proto::kVoid) return sides == 0 ? kVoidInside : sides == 1 ? kVoidSide : kVoidCorner;
  return sides == 0 ? caps.inside : sides == 1 ? caps.side : caps.corner;
}
/// Of a tile that will be welded.
inline constexpr ValenceCaps kWeldedCaps{kMostValence, kMendedSide, kMendedCorner};

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
