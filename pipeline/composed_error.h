#pragma once
// Above the blocks the finest samples are out of reach: the error of a parent is bounded by composition,
// stated(parent) <= the stated error of a finer surface + the distance between that surface and the parent's.
#include <memory>
#include <vector>

#include "gpu/refine.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Measures triangles of a parent against a finer surface of descendants: an upper bound of the distance between the two published
/// surfaces, flat ECEF triangles both, along the ellipsoid's normal, in metres, wherever both exist. They are compared at every vertex of
/// their overlay (welded vertices, and crossings of edges); between these, where the distance is not quite linear because normals turn, a
/// bound of its curvature is added. Points that help are the welded vertex that is farthest from the triangle or, where edges cross and no
/// vertex lies between, the ends of these edges, and the place of the greatest distance on the finer surface.
class ComposedMeter final : public gpu::ErrorMeter {
 public:
  /// welded: descendants of tile as one mesh. Borrowed, as is lattice.
  ComposedMeter(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& welded);
  ~ComposedMeter() override;

  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const override;

  /// The greatest error of parent's published triangles; those above limit_m are appended to over.
  double greatest_m(const proto::TileMesh& parent, double limit_m, std::vector<std::uint32_t>& over) const;
  double greatest_m(const proto::TileMesh& parent) const;

 private:
  class Ground;
  std::unique_ptr<Ground> ground_;
};

}  // namespace cordillera::pipeline
