#include "pipeline/tile/moved.h"

#include <cmath>

#include "gpu/measure/surface_error_window.h"
#include "pipeline/bound/overlay.h"

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

/// Vertices of the result in the input's order, but for those that moved.
std::vector<std::uint32_t> moved_vertices(const TileMesh& input, const TileMesh& mesh) {
  std::vector<std::uint32_t> moved;
  std::size_t next = 0;
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    std::size_t k = next;
    while (k < input.vertices() && (input.x[k] != mesh.x[v] || input.y[k] != mesh.y[v])) ++k;
    if (k < input.vertices())
      next = k + 1;
    else
      moved.push_back(v);
  }
  return moved;
}

std::int32_t sample_at(const LevelContext& context, const PreparedTile& prepared, const gpu::MeshPoint& p) {
  gpu::SurfaceErrorInput in;
  in.lattice = context.lattice;
  in.tile = prepared.tile;
  in.samples = context.samples;
  return gpu::SampleWindow(in, prepared.input.side).at(p.x, p.y);
}

std::int32_t surface_at(const TileMesh& surface, const gpu::MeshPoint& p) {
  for (const auto& t : surface.triangles) {
    if (!is_published(surface, t)) continue;
    const auto at = [&](std::size_t k) { return gpu::MeshPoint{surface.x[t[k]], surface.y[t[k]], surface.height[t[k]]}; };
    const gpu::MeshPoint a = at(0), b = at(1), c = at(2);
    const std::int64_t wa = gpu::twice_area(b, c, p), wb = gpu::twice_area(c, a, p), wc = gpu::twice_area(a, b, p);
    if (wa < 0 || wb < 0 || wc < 0) continue;
    const double sum = static_cast<double>(wa + wb + wc);
    const auto share = [&](std::int64_t w, const gpu::MeshPoint& q) { return static_cast<double>(w) / sum * q.height; };
    return static_cast<std::int32_t>(std::lround(share(wa, a) + share(wb, b) + share(wc, c)));
  }
  return proto::kNoHeight;
}

}  // namespace

void settle_moved(const LevelContext& context, const PreparedTile& prepared, TileMesh& mesh) {
  for (const std::uint32_t v : moved_vertices(prepared.input, mesh)) {
    if (is_void(mesh, v)) continue;
    const gpu::MeshPoint p{mesh.x[v], mesh.y[v], mesh.height[v]};
    const std::int32_t height = context.samples ? sample_at(context, prepared, p) : surface_at(prepared.input, p);
    if (height != proto::kNoHeight) mesh.height[v] = height;
  }
}

}  // namespace cordillera::pipeline
