#pragma once
// Pairs of triangles of two meshes that share ground, and the ground they share.
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::pipeline {

/// A point between lattice vertices, tile-local units.
struct PlanPoint {
  double x = 0, y = 0;
};

/// Positive when counter-clockwise: c is to the left of a -> b then.
inline double twice_area(PlanPoint a, PlanPoint b, PlanPoint c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// The common part of two triangles: a convex polygon of at most six corners. Rounding may add a corner to each stretch that a
/// side cuts off: 3, then 4, 6 and 9 at the very most.
struct Common {
  int count = 0;
  std::array<PlanPoint, 9> corner;
};

/// Empty when the triangles do not meet; may have no area when they only touch.
Common common_part(const std::array<PlanPoint, 3>& a, const std::array<PlanPoint, 3>& b);

std::array<PlanPoint, 3> plan_of(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle);

/// Empty at first.
struct PlanBox {
  double west = INFINITY, south = INFINITY, east = -INFINITY, north = -INFINITY;
  bool meets(const PlanBox& o) const { return west <= o.east && o.west <= east && south <= o.north && o.south <= north; }
  /// Grows to hold another one.
  void add(const PlanBox& o);
};

/// Finds the triangles of a mesh that may meet one, of those for which wanted is true. Those around small data in a large tile
/// are long and thin.
class TriangleIndex {
 public:
  using Wanted = bool (*)(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle);
  /// asked: holds all triangles that will be asked for.
  TriangleIndex(const proto::TileMesh& mesh, Wanted wanted, const PlanBox& asked = {-INFINITY, -INFINITY, INFINITY, INFINITY});
  /// All that touch it, and some that do not; ascending, each once; replaces what found held.
  void meeting(const std::array<PlanPoint, 3>& triangle, std::vector<std::uint32_t>& found) const;

 private:
  struct Cells {
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  };
  Cells cells_of(const PlanBox& box) const;
  bool touches(const std::array<PlanPoint, 3>& t, std::int32_t x, std::int32_t y) const;

  double west_ = 0, south_ = 0, cells_per_unit_ = 1;  // of the wanted triangles alone: data may be small in its tile
  std::int32_t across_ = 1;
  std::vector<std::uint32_t> start_;     // indexed by cell, one more at the end
  std::vector<std::uint32_t> triangle_;  // by cell
  std::vector<PlanBox> box_;             // indexed by triangle
};

/// Of the triangles for which wanted is true.
PlanBox box_around(const proto::TileMesh& mesh, TriangleIndex::Wanted wanted);

}  // namespace cordillera::pipeline
