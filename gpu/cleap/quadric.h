#pragma once
// Planes of triangles and the sums of their squared distances (section 3.2.2, Algorithm 1).
#include <cmath>

#include "gpu/cleap/structure.h"
#include "proto/mesh.h"

namespace cordillera::gpu::cleap {

/// a x + b y + c z + d = 0 about the mesh's origin; (a, b, c) has length 1.
struct Plane {
  double a, b, c, d;
};

/// With d as if the first point were the origin.
CORDILLERA_HD inline Plane plane_through(const Position& p, const Position& q, const Position& r) {
  const double ux = q.x - p.x, uy = q.y - p.y, uz = q.z - p.z, vx = r.x - p.x, vy = r.y - p.y, vz = r.z - p.z;
  const double a = uy * vz - uz * vy, b = uz * vx - ux * vz, c = ux * vy - uy * vx;
  const double length = sqrt(a * a + b * b + c * c), one = length > 0 ? 1 / length : 0;
  return {a * one, b * one, c * one, 0};
}

CORDILLERA_HD inline Plane plane_of(const Arrays& mesh, std::int32_t triangle) {
  const std::int32_t* const corner = mesh.corner + 3 * triangle;
  const Position& p = mesh.vertex[corner[0]];
  Plane plane = plane_through(p, mesh.vertex[corner[1]], mesh.vertex[corner[2]]);
  plane.d = -(plane.a * (p.x - mesh.origin.x) + plane.b * (p.y - mesh.origin.y) + plane.c * (p.z - mesh.origin.z));
  return plane;
}

CORDILLERA_HD inline void add_plane(PlaneQuadric& q, const Plane& p) {
  q.xx += p.a * p.a;
  q.xy += p.a * p.b;
  q.xz += p.a * p.c;
  q.xw += p.a * p.d;
  q.yy += p.b * p.b;
  q.yz += p.b * p.c;
  q.yw += p.b * p.d;
  q.zz += p.c * p.c;
  q.zw += p.c * p.d;
  q.ww += p.d * p.d;
}

CORDILLERA_HD inline PlaneQuadric sum(const PlaneQuadric& p, const PlaneQuadric& q) {
  return {p.xx + q.xx, p.xy + q.xy, p.xz + q.xz, p.xw + q.xw, p.yy + q.yy,
          p.yz + q.yz, p.yw + q.yw, p.zz + q.zz, p.zw + q.zw, p.ww + q.ww};
}

/// Equation 3.4; rounding may bring it below 0, where it stays 0.
CORDILLERA_HD inline double value(const PlaneQuadric& q, const Position& origin, const Position& at) {
  const double x = at.x - origin.x, y = at.y - origin.y, z = at.z - origin.z;
  const double v = x * (q.xx * x + 2 * (q.xy * y + q.xz * z + q.xw)) + y * (q.yy * y + 2 * (q.yz * z + q.yw)) +
                   z * (q.zz * z + 2 * q.zw) + q.ww;
  return v > 0 ? v : 0;
}

/// Where it is least (equation 3.10), solved about `near`; near itself where that is ill-conditioned or farther off than the
/// square of a distance says: a flat place has its least value everywhere.
CORDILLERA_HD inline Position least_near(const PlaneQuadric& q, const Position& origin, const Position& near, double distance2) {
  const double x = near.x - origin.x, y = near.y - origin.y, z = near.z - origin.z;
  const double gx = q.xx * x + q.xy * y + q.xz * z + q.xw, gy = q.xy * x + q.yy * y + q.yz * z + q.yw;
  const double gz = q.xz * x + q.yz * y + q.zz * z + q.zw;
  const double cxx = q.yy * q.zz - q.yz * q.yz, cxy = q.xz * q.yz - q.xy * q.zz, cxz = q.xy * q.yz - q.xz * q.yy;
  const double cyy = q.xx * q.zz - q.xz * q.xz, cyz = q.xy * q.xz - q.xx * q.yz, czz = q.xx * q.yy - q.xy * q.xy;
  const double det = q.xx * cxx + q.xy * cxy + q.xz * cxz, trace = q.xx + q.yy + q.zz;
  constexpr double kSmall = 1e-6;  // of what the determinant is where the planes look to all sides alike
  if (!(det > kSmall * trace * trace * trace / 27)) return near;
  const double dx = -(cxx * gx + cxy * gy + cxz * gz) / det, dy = -(cxy * gx + cyy * gy + cyz * gz) / det;
  const double dz = -(cxz * gx + cyz * gy + czz * gz) / det;
  if (!(dx * dx + dy * dy + dz * dz <= distance2)) return near;
  return {near.x + dx, near.y + dy, near.z + dz};
}

/// A triangle of a tile's hole has no height.
CORDILLERA_HD inline bool is_void(const Arrays& mesh, std::int32_t triangle) {
  const std::int32_t* const corner = mesh.corner + 3 * triangle;
  return mesh.tag && ((mesh.tag[corner[0]].mark | mesh.tag[corner[1]].mark | mesh.tag[corner[2]].mark) & proto::kVoid) != 0;
}

/// By vertex. Algorithm 1 adds from the triangles' side, by atomics in any order; a vertex that gathers has the same sum every
/// time.
struct SumPlanes {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t v) const {
    PlaneQuadric sum;
    all_triangles_at(mesh, static_cast<std::int32_t>(v), [&](std::int32_t triangle) {
      if (!is_void(mesh, triangle)) add_plane(sum, plane_of(mesh, triangle));
      return true;
    });
    mesh.quadric[v] = sum;
  }
};

}  // namespace cordillera::gpu::cleap
