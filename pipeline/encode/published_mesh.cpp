#include "pipeline/encode/published_mesh.h"

#include <algorithm>
#include <numeric>

namespace cordillera::pipeline {
namespace {

constexpr std::uint32_t kNoVertex = UINT32_MAX;

// A half-edge is named by the corner it starts at: corner 3 t + c of triangle t, running to corner next(3 t + c).
std::uint32_t next(std::uint32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

std::vector<Triangle> visible_triangles(const proto::TileMesh& mesh) {
  std::vector<Triangle> visible;
  visible.reserve(mesh.triangles.size());
  const auto is_void = [&](std::uint32_t v) { return (mesh.mark[v] & proto::kVoid) != 0; };
  for (const Triangle& t : mesh.triangles) {
    if (!is_void(t[0]) && !is_void(t[1]) && !is_void(t[2])) visible.push_back(t);
  }
  return visible;
}

// Indexed by corner: the half-edge that runs the other way, kNoVertex on the boundary.
std::vector<std::uint32_t> twins(const std::vector<Triangle>& triangles) {
  struct Edge {
    std::uint64_t ends;
    std::uint32_t corner;
  };
  const auto corners = static_cast<std::uint32_t>(3 * triangles.size());
  std::vector<Edge> edges(corners);
  for (std::uint32_t c = 0; c < corners; ++c) {
    const std::uint64_t a = triangles[c / 3][c % 3], b = triangles[c / 3][next(c) % 3];
    edges[c] = {std::min(a, b) << 32 | std::max(a, b), c};
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& p, const Edge& q) { return p.ends != q.ends ? p.ends < q.ends : p.corner < q.corner; });
  std::vector<std::uint32_t> twin(corners, kNoVertex);
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i].ends != edges[i + 1].ends) continue;
    twin[edges[i].corner] = edges[i + 1].corner;
    twin[edges[i + 1].corner] = edges[i].corner;
    ++i;
  }
  return twin;
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

PublishedMesh published_mesh(const proto::TileMesh& mesh) {
  const std::vector<Triangle> visible = visible_triangles(mesh);
  const std::vector<std::uint32_t> twin = twins(visible);
  Fans fans(twin.size());
  for (std::uint32_t c = 0; c < twin.size(); ++c) {
    if (twin[c] == kNoVertex || twin[c] < c) continue;
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
    if (twin[c] == kNoVertex) out.boundary.push_back({out.triangles[c / 3][c % 3], out.triangles[c / 3][next(c) % 3]});
  }
  return out;
}

}  // namespace cordillera::pipeline
