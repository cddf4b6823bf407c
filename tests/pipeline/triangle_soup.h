#pragma once
// Meshes as sets of triangles: what is the same however vertices and triangles are numbered.
#include <algorithm>
#include <array>
#include <vector>

#include "pipeline/encode/published_mesh.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::testing {

using Key = std::array<double, 3>;
inline Key key(proto::Vec3 p) { return {p.x, p.y, p.z}; }

/// Each triangle turned so that its least corner comes first; sorted.
template <class Point>
std::vector<std::array<Point, 3>> soup(const std::vector<Point>& points, const std::vector<Triangle>& triangles) {
  std::vector<std::array<Point, 3>> out;
  for (const Triangle& t : triangles) {
    std::array<Point, 3> corners = {points[t[0]], points[t[1]], points[t[2]]};
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    out.push_back(corners);
  }
  std::sort(out.begin(), out.end());
  return out;
}

}  // namespace cordillera::pipeline::testing
