#pragma once
// What is told of a result besides its error: angles, and what is broken.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::bench {

struct Shapes {
  std::array<std::uint64_t, 12> angles{};  ///< triangles by their least angle in the plan: 0-5, 5-10, ... 55-60 degrees
  double mean_angle_deg = 0;
  std::uint64_t turned = 0;          ///< triangles that turn the other way than most, or have no area
  std::uint32_t most_triangles = 0;  ///< at a vertex
};

inline Shapes shapes_of(const gpu::fit::HeightMesh& mesh) {
  Shapes shapes;
  std::uint64_t left = 0, right = 0;
  std::vector<std::uint32_t> at(mesh.vertices());
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    std::array<double, 3> length{};
    for (std::size_t k = 0; k < 3; ++k) {
      ++at[t[k]];
      length[k] = std::hypot(mesh.x[t[k]] - mesh.x[t[(k + 1) % 3]], mesh.y[t[k]] - mesh.y[t[(k + 1) % 3]]);
    }
    std::sort(length.begin(), length.end());
    const double area = (mesh.x[t[1]] - mesh.x[t[0]]) * (mesh.y[t[2]] - mesh.y[t[0]]) -
                        (mesh.y[t[1]] - mesh.y[t[0]]) * (mesh.x[t[2]] - mesh.x[t[0]]);
    ++(area > 0 ? left : right);
    // The least angle lies between the two longest sides.
    const double angle = std::asin(std::min(1.0, std::abs(area) / (length[1] * length[2]))) * 180 / std::acos(-1.0);
    sum += angle;
    ++shapes.angles[std::min<std::size_t>(11, static_cast<std::size_t>(angle / 5))];
  }
  for (const std::uint32_t count : at) shapes.most_triangles = std::max(shapes.most_triangles, count);
  shapes.turned = std::min(left, right);
  shapes.mean_angle_deg = sum / static_cast<double>(mesh.triangles.size());
  return shapes;
}

}  // namespace cordillera::bench
