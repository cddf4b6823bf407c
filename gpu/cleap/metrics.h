#pragma once
// What an edge costs and where its end goes (sections 3.2 and 4.3). A metric is one struct here and a name in AllMetrics, nothing
// else:
//   kName, kHelp    as the user writes it, and what it is
//   kQuadrics       whether it wants the quadrics of vertices
//   cost(), place() of an edge that is not gone; a cost is 0 or more. AtMiddle has the place of most
#include <cmath>
#include <string>

#include "gpu/cleap/quadric.h"
#include "gpu/cleap/structure.h"

namespace cordillera::gpu::cleap {

CORDILLERA_HD inline Position mid_point(const Arrays& mesh, const Edge& edge) {
  return middle(mesh.vertex[edge.n[0]], mesh.vertex[edge.n[1]]);
}

/// Of metrics whose vertex goes to the mid-point.
struct AtMiddle {
  static constexpr bool kQuadrics = false;
  CORDILLERA_HD static Position place(const Arrays& mesh, const Edge& edge) { return mid_point(mesh, edge); }
};

CORDILLERA_HD inline double quadrics_at(const Arrays& mesh, const Edge& edge, const Position& at) {
  return value(sum(mesh.quadric[edge.n[0]], mesh.quadric[edge.n[1]]), mesh.origin, at);
}

/// Algorithms 1 and 2: the quadrics of both ends at the mid-point.
struct QuadricAtMiddle : AtMiddle {
  static constexpr const char* kName = "qem";
  static constexpr const char* kHelp = "quadric at the mid-point, as published";
  static constexpr bool kQuadrics = true;
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) { return quadrics_at(mesh, edge, place(mesh, edge)); }
};

/// Equation 3.10; the mid-point where the matrix has no inverse to trust.
struct QuadricAtBest {
  static constexpr const char* kName = "qem-best";
  static constexpr const char* kHelp = "quadric where it is least";
  static constexpr bool kQuadrics = true;
  CORDILLERA_HD static Position place(const Arrays& mesh, const Edge& edge) {
    const Position mid = mid_point(mesh, edge), &p = mesh.vertex[edge.n[0]], &q = mesh.vertex[edge.n[1]];
    const double dx = p.x - q.x, dy = p.y - q.y, dz = p.z - q.z;
    const PlaneQuadric both = sum(mesh.quadric[edge.n[0]], mesh.quadric[edge.n[1]]);
    return least_near(both, mesh.origin, mid, dx * dx + dy * dy + dz * dz);
  }
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) { return quadrics_at(mesh, edge, place(mesh, edge)); }
};

CORDILLERA_HD inline double length_of(const Arrays& mesh, const Edge& edge) {
  const Position &p = mesh.vertex[edge.n[0]], &q = mesh.vertex[edge.n[1]];
  const double dx = p.x - q.x, dy = p.y - q.y, dz = p.z - q.z;
  return sqrt(dx * dx + dy * dy + dz * dz);
}

/// Algorithm 3.
struct EdgeLength : AtMiddle {
  static constexpr const char* kName = "length";
  static constexpr const char* kHelp = "length of the edge";
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) { return length_of(mesh, edge); }
};

CORDILLERA_HD inline double bend(const Plane& p, const Plane& q) { return (1 - (p.a * q.a + p.b * q.b + p.c * q.c)) / 2; }

/// Equation 3.11. It is for a collapse onto an end; both ends go here, so the dearer way counts.
struct Melax : AtMiddle {
  static constexpr const char* kName = "melax";
  static constexpr const char* kHelp = "length times curvature";
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) {
    const double there = curvature(mesh, edge, edge.n[0]), back = curvature(mesh, edge, edge.n[1]);
    return length_of(mesh, edge) * (there > back ? there : back);
  }

 private:
  CORDILLERA_HD static double curvature(const Arrays& mesh, const Edge& edge, std::int32_t v) {
    const Plane first = plane_of(mesh, edge.a[0] / 3), second = edge.b[0] < 0 ? first : plane_of(mesh, edge.b[0] / 3);
    double most = 0;
    all_triangles_at(mesh, v, [&](std::int32_t triangle) {
      const Plane plane = plane_of(mesh, triangle);
      const double to_first = bend(plane, first), to_second = bend(plane, second);
      const double nearer = to_first < to_second ? to_first : to_second;
      if (nearer > most) most = nearer;
      return true;
    });
    return most;
  }
};

/// Section 3.2.1: the angle between the two triangles.
struct DihedralAngle : AtMiddle {
  static constexpr const char* kName = "angle";
  static constexpr const char* kHelp = "angle between the edge's triangles";
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) {
    const double angle = edge.b[0] < 0 ? 1 : bend(plane_of(mesh, edge.a[0] / 3), plane_of(mesh, edge.b[0] / 3));
    return angle > 0 ? angle : 0;
  }
};

/// Ours, for height fields: how far above or below the planes around it the mid-point lies, at most.
struct VerticalDistance : AtMiddle {
  static constexpr const char* kName = "vertical";
  static constexpr const char* kHelp = "greatest vertical distance from the planes around";
  CORDILLERA_HD static double cost(const Arrays& mesh, const Edge& edge) {
    const Position at = place(mesh, edge);
    double most = 0;
    for (int end = 0; end < 2; ++end) {
      all_triangles_at(mesh, edge.n[end], [&](std::int32_t triangle) {
        const Plane plane = plane_of(mesh, triangle);
        const double away =
            (plane.a * (at.x - mesh.origin.x) + plane.b * (at.y - mesh.origin.y) + plane.c * (at.z - mesh.origin.z) + plane.d) /
            plane.c;
        const double distance = away < 0 ? -away : away;
        if (distance > most) most = distance;
        return true;
      });
    }
    return most;
  }
};

template <class... Each>
struct MetricList {};

/// All that there are: add yours here.
using AllMetrics = MetricList<QuadricAtMiddle, QuadricAtBest, EdgeLength, Melax, DihedralAngle, VerticalDistance>;

/// f(Metric{}) of that name; false: there is none.
template <class F, class... Each>
bool with_metric(MetricList<Each...>, const std::string& name, const F& f) {
  return ((name == Each::kName ? (f(Each{}), true) : false) || ...);
}
/// f(name, help) of all.
template <class F, class... Each>
void each_metric(MetricList<Each...>, const F& f) {
  (f(Each::kName, Each::kHelp), ...);
}

}  // namespace cordillera::gpu::cleap
