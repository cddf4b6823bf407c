#include "proto/mesh_file/join_vertices.h"

#include <bit>
#include <cstdint>
#include <vector>

namespace cordillera::proto {
namespace {

/// Of the place, by its coordinates' bits; 0 and -0 are one place.
std::size_t hash_of(const TriangleMesh& mesh, std::size_t v) {
  std::uint64_t hash = 0;
  for (const double value : {mesh.x[v], mesh.y[v], mesh.z[v]}) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(value + 0.0)) *
           0x9E3779B97F4A7C15u;  // 2^64 over the golden ratio (Knuth, volume 3, 6.4)
    hash ^= hash >> 29;
  }
  return static_cast<std::size_t>(hash);
}

/// For each vertex the first one at its place.
std::vector<std::uint32_t> first_at_place(const TriangleMesh& mesh) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  const std::size_t mask = std::bit_ceil(2 * mesh.vertices() + 1) - 1;
  std::vector<std::uint32_t> table(mask + 1, kNone), first(mesh.vertices());
  const auto same = [&](std::size_t a, std::size_t b) {
    return mesh.x[a] == mesh.x[b] && mesh.y[a] == mesh.y[b] && mesh.z[a] == mesh.z[b];
  };
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    std::size_t at = hash_of(mesh, v) & mask;
    while (table[at] != kNone && !same(table[at], v)) at = (at + 1) & mask;
    if (table[at] == kNone) table[at] = v;
    first[v] = table[at];
  }
  return first;
}

}  // namespace

std::optional<TriangleMesh> joined_vertices(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> number = first_at_place(mesh);
  TriangleMesh joined;
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] != v) {
      number[v] = number[number[v]];  // the first one has its new number by now
      continue;
    }
    number[v] = static_cast<std::uint32_t>(joined.x.size());
    joined.x.push_back(mesh.x[v]);
    joined.y.push_back(mesh.y[v]);
    joined.z.push_back(mesh.z[v]);
  }
  if (joined.vertices() == mesh.vertices()) return {};
  joined.triangles = mesh.triangles;
  for (auto& triangle : joined.triangles) {
    for (std::uint32_t& v : triangle) v = number[v];
  }
  return joined;
}

}  // namespace cordillera::proto
