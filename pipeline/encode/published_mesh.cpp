#include "pipeline/encode/published_mesh.h"

#include <algorithm>
#include <numeric>

#include "gpu/mesh/triangle_neighbours.h"

namespace cordillera::pipeline {
namespace {

constexpr std::uint32_t kNoVertex = UINT32_MAX;

// Corner 3 t + c of triangle t is where the half-edge of that number starts; it runs to corner next(3 t + c).
std::uint32_t next(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

std::vector<Triangle> visible_triangles(const proto::TileMesh& mesh, const std::vector<std::uint8_t>& left_out) {
  std::vector<Triangle> visible;
  visible.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_published(mesh, mesh.triangles[t]) && (left_out.empty() || left_out[t] == 0)) visible.push_back(mesh.triangles[t]);
  }
  return visible;
}

// Corners that are one vertex: those of one source vertex that a chain of shared edges connects.
class Fans {
 public:
  explicit Fans(std::size_t corners) : parent_(corners) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t c) {
    while (parent_[c] != c) c = parent_[c] = parent_[parent_[c]];
    return c;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

PublishedMesh published_mesh(const proto::TileMesh& mesh, const std::vector<std::uint8_t>& left_out) {
  const std::vector<Triangle> visible = visible_triangles(mesh, left_out);
  const std::vector<std::uint32_t> twin = gpu::twin_edges(visible);
  Fans fans(twin.size());
  for (std::uint32_t c = 0; c < twin.size(); ++c) {
    if (twin[c] == gpu::kNoEdge || twin[c] < c) continue;
    fans.join(c, next(twin[c]));
    fans.join(next(c), twin[c]);
  }

  PublishedMesh out;
  out.triangles.resize(visible.size());
  std::vector<std::uint32_t> vertex(twin.size(), kNoVertex);  // indexed by a fan's least corner
  for (std::uint32_t c = 0; c < twin.size(); ++c) {
    std::uint32_t& v = vertex[fans.find(c)];
    if (v == kNoVertex) {
      v = static_cast<std::uint32_t>(out.source.size());
      out.source.push_back(visible[c / 3][c % 3]);
    }
    out.triangles[c / 3][c % 3] = v;
  }
  for (std::uint32_t c = 0; c < twin.size(); ++c) {
    if (twin[c] == gpu::kNoEdge) out.boundary.push_back({out.triangles[c / 3][c % 3], out.triangles[c / 3][next(c) % 3]});
  }
  return out;
}

}  // namespace cordillera::pipeline
