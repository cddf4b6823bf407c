#pragma once
// Pairs of triangles of two meshes that share ground, and the ground they share.
#include <array>
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

/// Finds the triangles of a mesh whose boxes meet a box, of those for which wanted is true.
class TriangleIndex {
 public:
  using Wanted = bool (*)(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle);
  TriangleIndex(const proto::TileMesh& mesh, Wanted wanted);
  /// Ascending, each once; replaces what found held.
  void meeting(const std::array<PlanPoint, 3>& triangle, std::vector<std::uint32_t>& found) const;

 private:
  struct Cells {
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  };
  struct Box {
    double west = 0, south = 0, east = 0, north = 0;
    bool meets(const Box& o) const { return west <= o.east && o.west <= east && south <= o.north && o.south <= north; }
  };
  static Box box_of(const std::array<PlanPoint, 3>& t);
  Cells cells_of(const Box& box) const;

  double west_ = 0, south_ = 0, cells_per_unit_ = 1;  // of the wanted triangles alone: data may be small in its tile
  std::int32_t across_ = 1;
  std::vector<std::uint32_t> start_;     // indexed by cell, one more at the end
  std::vector<std::uint32_t> triangle_;  // by cell
  struct Cell {
    std::int32_t x = 0, y = 0;
  };
  std::vector<Box> box_;     // indexed by triangle
  std::vector<Cell> first_;  // likewise: its south-western one
};

}  // namespace cordillera::pipeline
