#pragma once
// Triangles cut at the sides of a box, in the plane of the lattice.
#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/bound/plan_point.h"
#include "pipeline/exports/mesh/mesh_request.h"

namespace cordillera::pipeline::exports {

/// A vertex of a mesh that grows, and where it lies.
struct ClipCorner {
  std::uint32_t vertex = 0;
  PlanPoint at;  ///< units of the finest lattice
};

/// The vertex that cuts the edge between two others at `at`, on a side of the box; share: of the way
/// from the first to the second. Asked with the lesser vertex first, so that both triangles at an edge get the same one.
using CutEdge = std::function<std::uint32_t(std::uint32_t from, std::uint32_t to, double share, const PlanPoint& at)>;

/// How far inside of a side (west, south, east, north) a place is, in units of the lattice.
double inside_of(const PlanPoint& at, const MeshWindow& box, int side);

/// The part of a triangle inside the box, a convex polygon that turns as the triangle does; fewer than three corners: nothing.
/// What is as near to a side as near says is on it.
std::vector<ClipCorner> clipped(const std::vector<ClipCorner>& triangle, const MeshWindow& box, double near, const CutEdge& cut);

}  // namespace cordillera::pipeline::exports
