#include "gpu/rings.h"

#include <algorithm>
#include <string>

namespace cordillera::gpu {
namespace {

using proto::Problem;
using proto::TileMesh;

// A triangle seen from one of its corners: the other two, counter-clockwise.
struct Wedge {
  std::uint32_t from = 0, to = 0;
};

// All wedges, gathered by corner (a counting sort).
struct Wedges {
  std::vector<std::uint32_t> start;  // indexed by vertex, one more at the end
  std::vector<Wedge> wedge;
};

Wedges gather_wedges(const TileMesh& mesh) {
  Wedges all;
  const std::size_t count = mesh.vertices();
  all.start.assign(count + 2, 0);
  for (const auto& t : mesh.triangles)
    for (const std::uint32_t v : t) ++all.start[v + 2];
  for (std::size_t v = 2; v < all.start.size(); ++v) all.start[v] += all.start[v - 1];
  all.wedge.resize(3 * mesh.triangles.size());
  // start[v + 1] serves as the write position of v, and ends as the start of v + 1.
  for (const auto& t : mesh.triangles) {
    all.wedge[all.start[t[0] + 1]++] = {t[1], t[2]};
    all.wedge[all.start[t[1] + 1]++] = {t[2], t[0]};
    all.wedge[all.start[t[2] + 1]++] = {t[0], t[1]};
  }
  all.start.pop_back();
  return all;
}

bool has_duplicates(std::span<const Wedge> fan) {
  std::uint64_t seen = 0;  // a wrong alarm of this filter only costs the exact look below
  for (const Wedge& w : fan) {
    const std::uint64_t bit = std::uint64_t{1} << (w.from & 63);
    if (seen & bit) {
      for (std::size_t i = 1; i < fan.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
          if (fan[i].from == fan[j].from) return true;
      return false;
    }
    seen |= bit;
  }
  return false;
}

// Where the ring begins: the wedge that follows none (open), else the one with the lowest neighbour.
std::size_t first_wedge(std::span<const Wedge> fan) {
  std::uint32_t parity = 0;
  std::size_t lowest = 0;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    parity ^= fan[i].from ^ fan[i].to;
    if (fan[i].from < fan[lowest].from) lowest = i;
  }
  if (parity == 0) return lowest;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    const auto follows = [&](const Wedge& w) { return w.to == fan[i].from; };
    if (std::none_of(fan.begin(), fan.end(), follows)) return i;
  }
  return lowest;
}

enum class Fan { closed, open, broken };

// Puts the wedges of one vertex end to end; reorders fan.
Fan chain_wedges(std::span<Wedge> fan, std::span<std::uint32_t> row, std::uint8_t& valence) {
  if (fan.size() > kRowWidth || has_duplicates(fan)) return Fan::broken;
  std::swap(fan[0], fan[first_wedge(fan)]);
  row[0] = fan[0].from;
  for (std::size_t i = 0; i + 1 < fan.size(); ++i) {
    std::size_t next = i + 1;
    while (next < fan.size() && fan[next].from != fan[i].to) ++next;
    if (next == fan.size()) return Fan::broken;
    std::swap(fan[i + 1], fan[next]);
    row[i + 1] = fan[i + 1].from;
  }
  valence = static_cast<std::uint8_t>(fan.size());
  if (fan.back().to == fan[0].from) return fan.size() < 3 ? Fan::broken : Fan::closed;
  if (fan.size() == kRowWidth) return Fan::broken;
  row[valence++] = fan.back().to;
  return Fan::open;
}

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
  const std::size_t count = mesh.vertices();
  Wedges all = gather_wedges(mesh);
  Rings rings;
  rings.neighbour.resize(count * kRowWidth);
  rings.valence.assign(count, 0);
  rings.open.assign(count, 0);
  for (std::size_t v = 0; v < count; ++v) {
    const std::span<Wedge> fan(all.wedge.data() + all.start[v], all.start[v + 1] - all.start[v]);
    if (fan.empty()) continue;
    const Fan kind = chain_wedges(fan, rings.row(static_cast<std::uint32_t>(v)), rings.valence[v]);
    if (kind == Fan::broken || (kind == Fan::open) != on_side(mesh, v)) return not_manifold(mesh, v, fan.size());
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
