#pragma once
// A vertex in a tile's plan, and the area of three.
#include <cstdint>

namespace cordillera::gpu {

/// Tile-local units, and height in kHeightStep_m.
struct MeshPoint {
  std::int32_t x = 0, y = 0, height = 0;
  bool operator==(const MeshPoint&) const = default;
};

/// Of three points with whole x and y; positive when counter-clockwise.
template <class Point>
std::int64_t twice_area(const Point& a, const Point& b, const Point& c) {
  return (std::int64_t{b.x} - a.x) * (std::int64_t{c.y} - a.y) - (std::int64_t{b.y} - a.y) * (std::int64_t{c.x} - a.x);
}

}  // namespace cordillera::gpu
