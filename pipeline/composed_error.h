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

  /// How far a triangle that reaches over a rim of the finer surface may be from samples there, which that surface leaves out: they are
  /// taken to lie no higher and no lower than the rim beside them. 0 where it reaches over none.
  double beyond_rims_m(const std::array<gpu::MeshPoint, 3>& corners) const;

 private:
  class Ground;
  std::unique_ptr<Ground> ground_;
};

/// The lesser of two bounds: by way of one surface, or of another one. Errors are those against the samples: the surfaces' own are in them.
/// Borrows both meters.
class NearerMeter final : public gpu::ErrorMeter {
 public:
  NearerMeter(const ComposedMeter& first, double first_m, const ComposedMeter& second, double second_m)
      : first_(first), second_(second), first_m_(first_m), second_m_(second_m) {}
  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const override;
  /// Of all published triangles of a mesh.
  double beyond_rims_m(const proto::TileMesh& mesh) const;

 private:
  const ComposedMeter &first_, &second_;
  double first_m_, second_m_;
};

/// The greatest error of mesh's published triangles; those above limit_m are appended to over.
double greatest_error_m(const gpu::ErrorMeter& meter, const proto::TileMesh& mesh, double limit_m, std::vector<std::uint32_t>& over);

}  // namespace cordillera::pipeline
