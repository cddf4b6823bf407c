#pragma once
// Above the blocks the finest samples are out of reach: the error of a parent is bounded by composition,
// stated(parent) <= max(stated(children)) + the distance between the children's surface and the parent's.
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

struct ComposedErrorInput {
  const proto::Lattice* lattice = nullptr;
  proto::TileAddress tile;                    ///< the parent
  const proto::TileMesh* welded = nullptr;    ///< its children, as welded
  const proto::TileMesh* parent = nullptr;    ///< its mesh; the same rectangle
};

/// An upper bound of the distance between the two published surfaces, flat ECEF triangles both, along the ellipsoid's normal, in
/// metres, wherever both exist. Both surfaces are compared at every vertex of their overlay (welded vertices, and crossings of
/// edges); between these, where the distance is not quite linear because normals turn, a bound of its curvature is added.
double composed_error_m(const ComposedErrorInput& input);

}  // namespace cordillera::pipeline
