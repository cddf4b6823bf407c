#pragma once
// Which edges may collapse, and what a collapse leaves.
#include "gpu/fit/steps/edge_quadric.h"

namespace cordillera::gpu::fit {

enum class EdgeChoice : std::uint8_t { all, border };

CORDILLERA_HD inline bool may_lose_neighbour(const Vertex& v) { return v.valence > (v.open() ? 2 : 3); }

/// Do the valences allow the edge from u to the i-th of its row to collapse?
CORDILLERA_HD inline bool valences_allow(const FitMesh& mesh, std::uint32_t u, std::uint32_t i) {
  const std::uint32_t* const row = mesh.row(u);
  const Vertex &at_u = mesh.vertex[u], &at_v = mesh.vertex[row[i]];
  const bool first = at_u.open() && i == 0, last = at_u.open() && i + 1 == at_u.valence;
  const std::uint32_t merged = std::uint32_t{at_u.valence} + at_v.valence - (first || last ? 3 : 4);
  const std::uint32_t widest = at_u.valence > at_v.valence ? at_u.valence : at_v.valence;
  if (merged > kMostNeighbours && merged > widest) return false;
  if (merged < (at_u.open() || at_v.open() ? 2u : 3u)) return false;
  if (!last && !may_lose_neighbour(mesh.vertex[row[mesh.next(at_u, i)]])) return false;
  return first || may_lose_neighbour(mesh.vertex[row[i == 0 ? at_u.valence - 1u : i - 1]]);
}

/// Of the edge from u to the i-th of its row, valences apart. A border vertex goes only along a border that runs straight through
/// it.
CORDILLERA_HD inline Leeway place_of_edge(const FitMesh& mesh, std::uint32_t u, std::uint32_t i, EdgeChoice choice) {
  const std::uint32_t v = mesh.row(u)[i];
  const Vertex &at_u = mesh.vertex[u], &at_v = mesh.vertex[v];
  if (((at_u.flags | at_v.flags) & (kOpen | kFixed)) == 0) return choice == EdgeChoice::all ? Leeway::anywhere : Leeway::nowhere;
  const bool border = at_u.open() && (i == 0 || i + 1 == at_u.valence);
  if (!border) {
    if (choice == EdgeChoice::border || (at_u.open() && at_v.open()) || (at_u.fixed() && at_v.fixed())) return Leeway::nowhere;
    return at_u.open() || at_u.fixed() ? Leeway::at_u : Leeway::at_v;
  }
  const bool u_goes = is_straight(mesh, u), v_goes = is_straight(mesh, v);
  if (!u_goes && !v_goes) return Leeway::nowhere;
  if (!v_goes) return Leeway::at_v;
  if (!u_goes) return Leeway::at_u;
  return at_u.y == at_v.y ? Leeway::along_x : at_u.x == at_v.x ? Leeway::along_y : Leeway::at_u;
}

/// The link of an edge: visit(a, b) for every triangle of u or v that the collapse leaves, until it returns false.
template <class Visit>
CORDILLERA_HD bool each_link_edge(const FitMesh& mesh, std::uint32_t u, std::uint32_t v, const Visit& visit) {
  for (int end = 0; end < 2; ++end) {
    const std::uint32_t from = end ? v : u, other = end ? u : v;
    const std::uint32_t* const row = mesh.row(from);
    const std::uint32_t valence = mesh.vertex[from].valence;
    std::uint32_t a = row[0];
    Vertex at_a = mesh.vertex[a];
    const bool closed = !mesh.vertex[from].open();
    for (std::uint32_t i = 1; i < valence + std::uint32_t{closed}; ++i) {
      const std::uint32_t b = row[i == valence ? 0 : i];
      const Vertex at_b = mesh.vertex[b];
      if (a != other && b != other && !visit(at_a, at_b)) return false;
      a = b;
      at_a = at_b;
    }
  }
  return true;
}

/// A straight-line triangulation whose triangles stay positive gets no doubled edge: nothing else need be asked.
CORDILLERA_HD inline bool link_sees(const FitMesh& mesh, std::uint32_t u, std::uint32_t v, Point p) {
  return each_link_edge(mesh, u, v, [&](const Vertex& a, const Vertex& b) { return turn(p, a.at(), b.at()) > 0; });
}

/// The vertex that the edge becomes.
CORDILLERA_HD inline Vertex merged(const FitMesh& mesh, std::uint32_t u, std::uint32_t v, const Candidate& candidate) {
  const std::uint8_t at_u = mesh.vertex[u].steep, at_v = mesh.vertex[v].steep;
  return {candidate.at.x, candidate.at.y, candidate.z, 0, 0, at_u > at_v ? at_u : at_v};
}

/// And would it be no spike?
CORDILLERA_HD inline bool link_rises(const FitMesh& mesh, std::uint32_t u, std::uint32_t v, const Candidate& candidate) {
  const Vertex at = merged(mesh, u, v, candidate);
  return at.steep == 0 ||
         each_link_edge(mesh, u, v, [&](const Vertex& a, const Vertex& b) { return may_see(at, a) && may_see(at, b); });
}

/// Would every sample around the edge stay within the limit?
template <class Samples>
CORDILLERA_HD bool link_within(const FitMesh& mesh, const Samples& samples, std::uint32_t u, std::uint32_t v,
                               const Candidate& candidate, ErrorLimit limit) {
  const Vertex at = merged(mesh, u, v, candidate);
  return each_link_edge(mesh, u, v, [&](const Vertex& a, const Vertex& b) { return is_within(samples, at, a, b, limit); });
}

/// The ring around the collapsed edge from u to the i-th of its row, from border to border if there is one; returns its length.
CORDILLERA_HD inline std::uint32_t merged_ring(const FitMesh& mesh, std::uint32_t u, std::uint32_t i, std::uint32_t* ring) {
  std::uint32_t v = mesh.row(u)[i], count = 0;
  const bool both_open = mesh.vertex[u].open() && mesh.vertex[v].open();
  if (both_open ? i != 0 : mesh.vertex[u].open()) {  // v is the open one; of two open ones, the one before u on the border
    const std::uint32_t swap = u;
    u = v;
    v = swap;
  }
  const std::uint32_t *const row_u = mesh.row(u), *const row_v = mesh.row(v);
  const std::uint32_t n_u = mesh.vertex[u].valence, n_v = mesh.vertex[v].valence;
  if (both_open) {
    for (std::uint32_t k = 0; k + 1 < n_v; ++k) ring[count++] = row_v[k];
    for (std::uint32_t k = 2; k < n_u; ++k) ring[count++] = row_u[k];
    return count;
  }
  std::uint32_t to_v = 0, to_u = 0;
  while (row_u[to_v] != v) ++to_v;
  while (row_v[to_u] != u) ++to_u;
  const auto around = [](std::uint32_t k, std::uint32_t n) { return k < n ? k : k - n; };
  if (mesh.vertex[v].open()) {
    for (std::uint32_t k = 0; k < to_u; ++k) ring[count++] = row_v[k];
    for (std::uint32_t k = 2; k < n_u; ++k) ring[count++] = row_u[around(to_v + k, n_u)];
    for (std::uint32_t k = to_u + 2; k < n_v; ++k) ring[count++] = row_v[k];
    return count;
  }
  for (std::uint32_t k = 1; k < n_u; ++k) ring[count++] = row_u[around(to_v + k, n_u)];
  for (std::uint32_t k = 2; k + 1 < n_v; ++k) ring[count++] = row_v[around(to_u + k, n_v)];
  return count;
}

}  // namespace cordillera::gpu::fit
