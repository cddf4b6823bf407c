#pragma once
// A tile's rectangle in plan, cut into triangles that are data or sea.
#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/faces/quantized_mesh/plane_triangulation.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_sides.h"

namespace cordillera::pipeline::faces {

struct QuantizedPlan {
  static constexpr std::uint32_t kNone = PlaneTriangulation::kNone;
  struct Vertex {
    PlaneTriangulation::Point at;         ///< quanta
    std::array<std::int32_t, 2> units{};  ///< of the grid, from the tile's south-west
    std::uint32_t source = kNone;         ///< vertex of the tile's mesh; kNone: only the sea is here
  };
  struct Face {
    Triangle vertex{};
    std::array<std::uint32_t, 3> beside{};  ///< as PlaneTriangulation::Face
    bool data = false;                      ///< all three vertices have a source
  };
  std::vector<Vertex> vertices;
  std::vector<Face> faces;
  std::array<SideLine, 4> lines;  ///< as kSides
};

/// mesh: null where the tile has none. Rounding moves vertices by half a quantum, or one where a side is left to the sea;
/// triangles that this would turn over are cut anew.
QuantizedPlan quantized_plan(const MeshGrid& grid, const QuantizedLevel& level, const proto::TileAddress& tile,
                             const MeshIndex* mesh);

}  // namespace cordillera::pipeline::faces
