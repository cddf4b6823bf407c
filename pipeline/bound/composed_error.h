#pragma once
// Above the blocks the finest samples are out of reach: the error of a parent is bounded by composition,
// stated(parent) <= the stated error of a finer surface + the distance between that surface and the parent's.
// What a finer surface leaves uncovered it hands up, see surface.h, so that nothing a parent covers is without a bound.
#include <memory>
#include <vector>

#include "gpu/measure/ecef_steps.h"
#include "gpu/refine/refine.h"
#include "pipeline/bound/surface.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Measures triangles of a parent by way of a finer surface: an upper bound of how far finest samples are from them, in metres.
///
/// Of samples that the finer surface or its patches cover it is that surface's own error, what rounding can add, and the distance
/// between the two, flat ECEF triangles both, along the ellipsoid's normal. They are compared at every vertex of their overlay
/// (welded vertices, and crossings of edges); between these, where the distance is not quite linear because normals turn, a bound
/// of its curvature is added. Loose samples are measured themselves. Points that help are the loose sample that is too far; the
/// welded vertex that is farthest from the triangle or, where edges cross and no vertex lies between, the ends of these edges;
/// and the place of the greatest distance.
class ComposedMeter final : public gpu::ErrorMeter {
 public:
  /// mesh, loose: of a finer surface over the tile, which is max_error_m off where the mesh is. lattice is borrowed.
  ComposedMeter(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh, double max_error_m,
                const Loose& loose, const gpu::EcefSteps& ecef_steps);
  ~ComposedMeter() override;

  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const override;
  double error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance& asked) const override;
  /// Of a triangle that is like the finer surface: its error and rounding.
  double least_m() const;
  /// How many points refinement may need.
  std::size_t points() const;

 private:
  class Ground;
  std::unique_ptr<Ground> ground_;
};

/// The lesser of two bounds: by way of one surface, or of another one. Borrows both meters.
class NearerMeter final : public gpu::ErrorMeter {
 public:
  NearerMeter(const ComposedMeter& first, const ComposedMeter& second) : first_(first), second_(second) {}
  gpu::TriangleError measure(const std::array<gpu::MeshPoint, 3>& corners, double limit_m) const override;
  double error_m(const std::array<gpu::MeshPoint, 3>& corners, const gpu::Glance& asked) const override;

 private:
  const ComposedMeter &first_, &second_;
};

/// The greatest error of mesh's published triangles; those above limit_m are appended to over.
double greatest_error_m(const gpu::ErrorMeter& meter, const proto::TileMesh& mesh, double limit_m,
                        std::vector<std::uint32_t>& over);

}  // namespace cordillera::pipeline
