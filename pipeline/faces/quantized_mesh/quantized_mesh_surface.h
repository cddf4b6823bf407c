#pragma once
// A tile of quantized-mesh before it becomes bytes: a surface over the whole rectangle, with the data where there is data, the
// sea elsewhere and upright walls between them.
#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/encode/published_mesh.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_sides.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

struct QuantizedSurface {
  struct Vertex {
    std::int32_t u = 0, v = 0;  ///< quanta, from the south-west
    std::int32_t height = 0;    ///< of the level's steps above the ellipsoid
    proto::Vec3 normal;         ///< unit, earth-centred
  };
  TileAngles angles;
  double step_m = 0;
  std::vector<Vertex> vertices;                     ///< in the order in which the triangles first name them
  std::vector<Triangle> triangles;                  ///< counter-clockwise from above; those of walls have no area in plan
  std::array<std::vector<std::uint32_t>, 4> sides;  ///< as kSides: all vertices on it, from the south or the west
};

/// Whether the face has a tile: all at level 0, and four children wherever the dataset has something below one of them. z: up to
/// the grid's finest.
bool has_quantized_tile(const MeshGrid& grid, const proto::TileAddress& tile);

QuantizedSurface quantized_surface(const MeshGrid& grid, const proto::TileAddress& tile);

}  // namespace cordillera::pipeline::faces
