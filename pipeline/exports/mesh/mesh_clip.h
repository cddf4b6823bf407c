#pragma once
// Triangles cut at the sides of a box, in the plane of the lattice.
#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/exports/mesh/mesh_request.h"

namespace cordillera::pipeline::exports {

/// A vertex of a mesh that grows, and where it lies.
struct ClipCorner {
  std::uint32_t vertex = 0;
  double u = 0, v = 0;  ///< units of the finest lattice
};

/// Which vertex cuts the edge between two others, at a share of the way from the first to the second. side: which of the box's.
/// Asked with the lesser vertex first, so that both triangles at an edge get the same one.
using CutEdge = std::function<std::uint32_t(std::uint32_t from, std::uint32_t to, int side, double share)>;

/// The part of a triangle inside the box, a convex polygon that turns as the triangle does; fewer than three corners: nothing.
std::vector<ClipCorner> clipped(const std::vector<ClipCorner>& triangle, const MeshWindow& box, const CutEdge& cut);

}  // namespace cordillera::pipeline::exports
