#pragma once
// The cost of a collapse: the memoryless quadric, with distances along the vertical (P. Lindstrom, G. Turk, 1998 and 1999).
#include "proto/host_device.h"

namespace cordillera::gpu {

/// Sum over triangles around a vertex of area x (distance to the triangle's plane along the vertical)^2, as a quadratic form of
/// a place relative to the vertex. Whoever adds leaves out what counts nothing. Units are the caller's.
struct VerticalQuadric {
  float xx = 0, xy = 0, yy = 0, x = 0, y = 0, one = 0;

  /// The triangle (vertex, a, b), counter-clockwise.
  CORDILLERA_HD void add(float ax, float ay, float az, float bx, float by, float bz) {
    const float twice_area = ax * by - ay * bx;
    const float nx = ay * bz - az * by, ny = az * bx - ax * bz;
    const float inverse = 1.0f / twice_area;
    xx += nx * nx * inverse;
    xy += nx * ny * inverse;
    yy += ny * ny * inverse;
    x += nx;
    y += ny;
    one += twice_area;
  }
  /// Of going there; not below 0.
  CORDILLERA_HD float at(float px, float py, float pz) const {
    const float cost = 0.5f * (xx * px * px + yy * py * py + one * pz * pz) + (xy * px * py + pz * (x * px + y * py));
    return cost < 0 ? 0 : cost;
  }
};

}  // namespace cordillera::gpu
