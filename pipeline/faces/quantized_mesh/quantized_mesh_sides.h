#pragma once
// What two neighbouring tiles have on their common side: a function of both meshes that each of them works out for itself.
#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/faces/quantized_mesh/mesh_grid.h"

namespace cordillera::pipeline::faces {

enum class MeshSide : std::uint8_t { west, south, east, north };
inline constexpr std::array<MeshSide, 4> kSides = {MeshSide::west, MeshSide::south, MeshSide::east, MeshSide::north};

/// Along a side, from the south or the west.
struct SidePoint {
  std::int32_t at = 0;      ///< quanta
  std::int32_t units = 0;   ///< units of the grid
  std::int32_t height = 0;  ///< of the data, steps of the .drc; only if one of the pieces beside it is data
  bool data_after = false;  ///< whether the piece from here to the next point is data; the sea otherwise
};
/// The first is at 0, the last at kMostQuanta.
using SideLine = std::vector<SidePoint>;

/// Units that a mesh has across the side (0 or its length) and along it.
std::array<std::int32_t, 2> across_and_along(MeshSide side, const std::array<std::int32_t, 3>& point);

/// The piece between two vertices is data where both tiles have a triangle on it: what only one of them has ends there, at a
/// wall. Beside the data the line has the vertices of the sea's grid. mesh: null where the tile has none. Poles have nobody
/// beyond them: there a tile's own edges count for both.
SideLine side_line(const MeshGrid& grid, const QuantizedLevel& level, const proto::TileAddress& tile, MeshSide side);

}  // namespace cordillera::pipeline::faces
