// One side after the other, after Sutherland and Hodgman, Reentrant polygon clipping, 1974.
#include "pipeline/exports/mesh/mesh_clip.h"

#include <utility>

namespace cordillera::pipeline::exports {
namespace {

/// How far inside of a side: west, south, east, north.
double inside(const ClipCorner& c, const MeshWindow& box, int side) {
  switch (side) {
    case 0: return c.u - box.west;
    case 1: return c.v - box.south;
    case 2: return box.east - c.u;
    default: return box.north - c.v;
  }
}

ClipCorner cut_between(ClipCorner a, ClipCorner b, const MeshWindow& box, int side, const CutEdge& cut) {
  if (a.vertex > b.vertex) std::swap(a, b);
  const double before = inside(a, box, side), after = inside(b, box, side);
  const double share = before / (before - after);
  ClipCorner c{cut(a.vertex, b.vertex, side, share), a.u + share * (b.u - a.u), a.v + share * (b.v - a.v)};
  // On the side exactly, so that the next corner's test finds it there.
  if (side == 0) c.u = box.west;
  if (side == 1) c.v = box.south;
  if (side == 2) c.u = box.east;
  if (side == 3) c.v = box.north;
  return c;
}

}  // namespace

std::vector<ClipCorner> clipped(const std::vector<ClipCorner>& triangle, const MeshWindow& box, const CutEdge& cut) {
  std::vector<ClipCorner> polygon = triangle;
  for (int side = 0; side < 4 && !polygon.empty(); ++side) {
    std::vector<ClipCorner> kept;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const ClipCorner &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      const double at_a = inside(a, box, side), at_b = inside(b, box, side);
      if (at_a >= 0) kept.push_back(a);
      if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0)) kept.push_back(cut_between(a, b, box, side, cut));
    }
    polygon = std::move(kept);
  }
  return polygon;
}

}  // namespace cordillera::pipeline::exports
