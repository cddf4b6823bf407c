// One side after the other, after Sutherland and Hodgman, Reentrant polygon clipping, 1974.
#include "pipeline/exports/mesh/mesh_clip.h"

#include <cmath>
#include <utility>

namespace cordillera::pipeline::exports {
namespace {

ClipCorner cut_between(ClipCorner a, ClipCorner b, const MeshWindow& box, int side, const CutEdge& cut) {
  if (a.vertex > b.vertex) std::swap(a, b);
  const double before = inside_of(a.at, box, side), after = inside_of(b.at, box, side);
  const double share = before / (before - after);
  PlanPoint at{a.at.x + share * (b.at.x - a.at.x), a.at.y + share * (b.at.y - a.at.y)};
  // On the side exactly, so that the next corner's test finds it there.
  if (side == 0) at.x = box.west;
  if (side == 1) at.y = box.south;
  if (side == 2) at.x = box.east;
  if (side == 3) at.y = box.north;
  return {cut(a.vertex, b.vertex, share, at), at};
}

}  // namespace

double inside_of(const PlanPoint& at, const MeshWindow& box, int side) {
  switch (side) {
    case 0: return at.x - box.west;
    case 1: return at.y - box.south;
    case 2: return box.east - at.x;
    default: return box.north - at.y;
  }
}

std::vector<ClipCorner> clipped(const std::vector<ClipCorner>& triangle, const MeshWindow& box, double near, const CutEdge& cut) {
  const auto inside = [&](const ClipCorner& c, int side) {
    const double far = inside_of(c.at, box, side);
    return std::abs(far) <= near ? 0 : far;
  };
  std::vector<ClipCorner> polygon = triangle;
  for (int side = 0; side < 4 && !polygon.empty(); ++side) {
    std::vector<ClipCorner> kept;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const ClipCorner &a = polygon[k], &b = polygon[(k + 1) % polygon.size()];
      const double at_a = inside(a, side), at_b = inside(b, side);
      if (at_a >= 0) kept.push_back(a);
      if ((at_a > 0 && at_b < 0) || (at_a < 0 && at_b > 0)) kept.push_back(cut_between(a, b, box, side, cut));
    }
    polygon = std::move(kept);
  }
  return polygon;
}

}  // namespace cordillera::pipeline::exports
