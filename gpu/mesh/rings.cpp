#include "gpu/mesh/rings.h"

#include <numeric>
#include <string>

#include "gpu/mesh/wedges.h"

namespace cordillera::gpu {
namespace {

using proto::Problem;
using proto::TileMesh;

bool on_side(const TileMesh& mesh, std::size_t v) {
  return mesh.x[v] == 0 || mesh.y[v] == 0 || mesh.x[v] == mesh.side || mesh.y[v] == mesh.side;
}

Problem not_manifold(const TileMesh& mesh, std::size_t v, std::size_t triangles) {
  return {"mesh-not-manifold",
          "the " + std::to_string(triangles) + " triangles around vertex " + std::to_string(v) + " at (" +
              std::to_string(mesh.x[v]) + ", " + std::to_string(mesh.y[v]) + ") are not one fan",
          "a manifold of valence <= " + std::to_string(kRowWidth) + " over the whole tile", ""};
}

}  // namespace

proto::Result<Rings> rings_from_triangles(const TileMesh& mesh) {
  const std::size_t count = mesh.vertices(), triangles = mesh.triangles.size();
  std::vector<std::uint32_t> end(count, 0);  // indexed by vertex: its wedges counted, then where they begin, then where they end
  std::vector<Wedge> wedges(3 * triangles);
  for (std::size_t i = 0; i < triangles; ++i) CountWedges{mesh.triangles.data(), end.data()}(i);
  std::exclusive_scan(end.begin(), end.end(), end.begin(), 0u);
  for (std::size_t i = 0; i < triangles; ++i) PlaceWedges{mesh.triangles.data(), end.data(), wedges.data()}(i);
  Rings rings;
  rings.neighbour.resize(count * kRowWidth);
  rings.valence.assign(count, 0);
  rings.open.assign(count, 0);
  for (std::size_t v = 0; v < count; ++v) {
    const std::uint32_t begin = v == 0 ? 0 : end[v - 1], size = end[v] - begin;
    if (size == 0) continue;
    const Fan kind = chain_wedges(wedges.data() + begin, size, rings.row(static_cast<std::uint32_t>(v)).data(), rings.valence[v]);
    if (kind == Fan::broken || (kind == Fan::open) != on_side(mesh, v)) return not_manifold(mesh, v, size);
    rings.open[v] = kind == Fan::open ? 1 : 0;
  }
  return rings;
}

std::vector<std::array<std::uint32_t, 3>> triangles_from_rings(const Rings& rings) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(2 * rings.vertices());
  for (std::uint32_t v = 0; v < rings.vertices(); ++v) {
    const std::span<const std::uint32_t> ring = rings.ring(v);
    for (std::size_t i = 0; i < rings.triangles_at(v); ++i) {
      const std::uint32_t a = ring[i], b = ring[i + 1 == ring.size() ? 0 : i + 1];
      if (v < a && v < b) triangles.push_back({v, a, b});
    }
  }
  return triangles;
}

TileMesh mesh_from_rings(const TileMesh& original, const Rings& rings) {
  TileMesh mesh;
  mesh.side = original.side;
  std::vector<std::uint32_t> moved(rings.vertices(), 0);
  mesh.x.reserve(rings.vertices());
  mesh.y.reserve(rings.vertices());
  mesh.height.reserve(rings.vertices());
  mesh.mark.reserve(rings.vertices());
  for (std::size_t v = 0; v < rings.vertices(); ++v) {
    if (rings.valence[v] == 0) continue;
    moved[v] = static_cast<std::uint32_t>(mesh.vertices());
    mesh.x.push_back(original.x[v]);
    mesh.y.push_back(original.y[v]);
    mesh.height.push_back(original.height[v]);
    mesh.mark.push_back(original.mark[v]);
  }
  mesh.triangles = triangles_from_rings(rings);
  for (auto& t : mesh.triangles)
    for (std::uint32_t& v : t) v = moved[v];
  return mesh;
}

}  // namespace cordillera::gpu
