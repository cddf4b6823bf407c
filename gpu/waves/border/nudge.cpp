#include "gpu/waves/border/nudge.h"

#include <algorithm>

namespace cordillera::gpu {
namespace {

bool positive(const proto::TileMesh& mesh, std::int64_t x, std::int64_t y, std::uint32_t b, std::uint32_t c) {
  return (mesh.x[b] - x) * (mesh.y[c] - y) - (mesh.y[b] - y) * (mesh.x[c] - x) > 0;
}

/// Do all triangles around a vertex at (x, y) with this closed ring have positive area?
bool fits(const proto::TileMesh& mesh, std::span<const std::uint32_t> ring, std::int64_t x, std::int64_t y) {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    if (!positive(mesh, x, y, ring[k], ring[(k + 1) % ring.size()])) return false;
  }
  return true;
}

bool nudge(Rings& rings, proto::TileMesh& mesh, std::uint32_t v) {
  const std::span<const std::uint32_t> ring = rings.ring(v);
  const std::uint32_t first = ring.front(), last = ring.back();
  if (!may_have(mesh, first, rings.valence[first] + 1u) || !may_have(mesh, last, rings.valence[last] + 1u)) return false;
  const std::int64_t in_x = mesh.x[v] == 0 ? 1 : mesh.x[v] == mesh.side ? -1 : 0;
  const std::int64_t in_y = mesh.y[v] == 0 ? 1 : mesh.y[v] == mesh.side ? -1 : 0;
  for (std::int64_t d = 1; d < mesh.side; d *= 2) {
    const std::int64_t x = mesh.x[v] + in_x * d, y = mesh.y[v] + in_y * d;
    if (!fits(mesh, ring, x, y)) continue;
    mesh.x[v] = static_cast<std::int32_t>(x);
    mesh.y[v] = static_cast<std::int32_t>(y);
    mesh.mark[v] &= proto::kVoid;
    rings.open[v] = 0;
    rings.row(first)[rings.valence[first]++] = last;
    const auto row = rings.row(last);
    std::copy_backward(row.begin(), row.begin() + rings.valence[last], row.begin() + rings.valence[last] + 1);
    row[0] = first;
    ++rings.valence[last];
    return true;
  }
  return false;
}

}  // namespace

std::uint32_t nudge_inwards(Rings& rings, proto::TileMesh& mesh, Steps steps) {
  const auto has_data = [&](std::uint32_t v) { return !is_void(mesh, v); };
  const auto may_step = [&](std::uint32_t v) {
    const auto ring = rings.ring(v);
    return steps == Steps::anywhere || !has_data(v) || std::all_of(ring.begin(), ring.end(), has_data);
  };
  std::uint32_t left = 0;
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
    if (rings.valence[v] > 0 && (mesh.mark[v] & proto::kRemove) && !(may_step(v) && nudge(rings, mesh, v))) ++left;
  }
  return left;
}

}  // namespace cordillera::gpu
