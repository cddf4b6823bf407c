#pragma once
// The triangles of a tile's mesh, as they are measured.
#include <array>
#include <cstdint>

#include "gpu/measure/surface_error_triangle.h"
#include "gpu/measure/surface_error_window.h"
#include "gpu/mesh/mesh_point.h"

namespace cordillera::gpu {

/// Borrows the mesh.
class TileTriangles {
 public:
  explicit TileTriangles(const proto::TileMesh& mesh) : mesh_(mesh), rims_(mesh) {}

  bool is_published(std::uint32_t triangle) const { return proto::is_published(mesh_, mesh_.triangles[triangle]); }
  std::array<MeshPoint, 3> corners(std::uint32_t triangle) const {
    const auto point = [this](std::uint32_t v) { return MeshPoint{mesh_.x[v], mesh_.y[v], mesh_.height[v]}; };
    const auto& [a, b, c] = mesh_.triangles[triangle];
    return {point(a), point(b), point(c)};
  }
  /// See measured_triangle. corners: of this triangle.
  unsigned owned_edges(std::uint32_t triangle, const std::array<MeshPoint, 3>& corners) const {
    const auto& v = mesh_.triangles[triangle];
    unsigned owned = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned n = k == 2 ? 0 : k + 1;
      if (counts_edge(mesh_.side, corners[k], corners[n]) || rims_.contains(v[k], v[n])) owned |= 1u << k;
    }
    return owned;
  }

 private:
  const proto::TileMesh& mesh_;
  const Rims rims_;
};

}  // namespace cordillera::gpu
