#pragma once
// Shapes of triangles in plan, as refinement judges them. Doubles: a tie decided wrongly costs a little shape, and all machines
// decide alike.
#include <algorithm>

#include "gpu/mesh/mesh_point.h"

namespace cordillera::gpu {

inline double length2(const MeshPoint& a, const MeshPoint& b) {
  const double dx = a.x - b.x, dy = a.y - b.y;
  return dx * dx + dy * dy;
}

/// A triangle without is a needle: 32 times as long as it is high. Its area is positive too, but roundings tilt it.
inline bool has_body(const MeshPoint& a, const MeshPoint& b, const MeshPoint& c) {
  constexpr double kNeedle = 32;
  return kNeedle * static_cast<double>(twice_area(a, b, c)) >= std::max({length2(a, b), length2(b, c), length2(c, a), 1.0});
}

/// Is c less than half a unit from the line through a and b?
inline bool all_but_on(const MeshPoint& a, const MeshPoint& b, const MeshPoint& c) {
  const double twice = static_cast<double>(twice_area(a, b, c));
  return 4 * twice * twice < length2(a, b);
}

/// Is d inside the circle through a, b, c (counter-clockwise)?
inline bool in_circle(const MeshPoint& a, const MeshPoint& b, const MeshPoint& c, const MeshPoint& d) {
  const double ax = a.x - d.x, ay = a.y - d.y, bx = b.x - d.x, by = b.y - d.y, cx = c.x - d.x, cy = c.y - d.y;
  const double a2 = ax * ax + ay * ay, b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
  const double in = ax * (by * c2 - b2 * cy) - ay * (bx * c2 - b2 * cx) + a2 * (bx * cy - by * cx);
  return in > 1e-9 * (a2 + b2 + c2) * (a2 + b2 + c2);
}

}  // namespace cordillera::gpu
