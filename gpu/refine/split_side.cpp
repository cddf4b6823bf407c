#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "gpu/mesh/refine_shape.h"
#include "gpu/mesh/tile_valence.h"
#include "gpu/mesh/triangle_neighbours.h"
#include "gpu/refine/refine.h"
#include "gpu/refine/side_points.h"

namespace cordillera::gpu {
namespace {

std::size_t neighbours_of(const proto::TileMesh& mesh, std::uint32_t v) {
  std::vector<std::uint32_t> all;
  for (const auto& t : mesh.triangles) {
    if (t[0] == v || t[1] == v || t[2] == v) all.insert(all.end(), t.begin(), t.end());
  }
  std::sort(all.begin(), all.end());
  return static_cast<std::size_t>(std::unique(all.begin(), all.end()) - all.begin()) - 1;  // v itself is among them
}

/// The corner opposite the edge v - w (in this direction) of the triangle there, and that triangle.
std::optional<std::pair<std::size_t, std::uint32_t>> triangle_at_edge(const proto::TileMesh& mesh, std::uint32_t v,
                                                                      std::uint32_t w) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::array<std::uint32_t, 3>& c = mesh.triangles[t];
    for (unsigned k = 0; k < 3; ++k) {
      if (c[k] == v && c[after(k)] == w) return std::pair{t, c[before(k)]};
    }
  }
  return std::nullopt;
}

/// An edge and the one that would be there in its place.
struct Turn {
  std::size_t t = 0, u = 0;             // the triangles beside it
  std::array<std::uint32_t, 4> quad{};  // counter-clockwise; the edge is from the first to the third
  double apart = INFINITY;              // both edges in height, where they cross
};

/// Turning the edge from corner k of t to the next one; none where that cannot be. All corners have data.
std::optional<Turn> turn_of(const proto::TileMesh& mesh, std::size_t t, unsigned k) {
  const std::array<std::uint32_t, 3>& corners = mesh.triangles[t];
  const std::uint32_t c = corners[k], w = corners[after(k)], e = corners[before(k)];
  const auto beyond = triangle_at_edge(mesh, w, c);
  if (!beyond) return std::nullopt;
  const auto [u, d] = *beyond;
  if (is_void(mesh, c) || is_void(mesh, w) || is_void(mesh, d) || is_void(mesh, e)) return std::nullopt;
  for (const std::uint32_t gains : {d, e}) {
    if (!may_have(mesh, gains, neighbours_of(mesh, gains) + 1)) return std::nullopt;
  }
  const auto point = [&](std::uint32_t v) { return MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
  const auto at_w = twice_area(point(d), point(w), point(e)), at_c = twice_area(point(d), point(e), point(c));
  if (at_w <= 0 || at_c <= 0) return std::nullopt;
  const auto at_d = static_cast<double>(twice_area(point(c), point(d), point(w))),
             at_e = static_cast<double>(twice_area(point(c), point(w), point(e)));
  const auto between = [&](std::uint32_t from, std::uint32_t to, double share) {
    return mesh.height[from] + share * (static_cast<double>(mesh.height[to]) - mesh.height[from]);
  };
  const double to_w = static_cast<double>(at_c) / static_cast<double>(at_c + at_w), to_e = at_d / (at_d + at_e);
  return Turn{t, u, {c, d, w, e}, std::abs(between(c, w, to_w) - between(d, e, to_e))};
}

/// Takes a neighbour other than v from c, by the turn that changes the surface least. False: none can be turned.
bool take_neighbour(proto::TileMesh& mesh, std::uint32_t c, std::uint32_t v) {
  Turn best;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (unsigned k = 0; k < 3; ++k) {
      if (mesh.triangles[t][k] != c || mesh.triangles[t][after(k)] == v) continue;
      const std::optional<Turn> turn = turn_of(mesh, t, k);
      if (turn && turn->apart < best.apart) best = *turn;
    }
  }
  if (best.apart == INFINITY) return false;
  const auto& [first, d, w, e] = best.quad;
  mesh.triangles[best.t] = {d, w, e};
  mesh.triangles[best.u] = {d, e, first};
  return true;
}

}  // namespace

bool split_side(proto::TileMesh& mesh, const MeshPoint& p) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::array<std::uint32_t, 3> corners = mesh.triangles[t];
      const std::uint32_t a = corners[k], b = corners[after(k)], c = corners[before(k)];
      const auto point = [&](std::uint32_t v) { return MeshPoint{mesh.x[v], mesh.y[v], mesh.height[v]}; };
      if (!lie_on_a_side(mesh, point(a), point(b)) || !lie_on_a_side(mesh, point(a), p) || !lie_on_a_side(mesh, point(b), p))
        continue;
      if (!is_between(p, point(a), point(b))) continue;
      if (is_void(mesh, a) || is_void(mesh, b)) return false;
      const bool has_room = may_have(mesh, c, neighbours_of(mesh, c) + 1);
      const auto v = static_cast<std::uint32_t>(mesh.vertices());
      mesh.x.push_back(p.x);
      mesh.y.push_back(p.y);
      mesh.height.push_back(p.height);
      mesh.mark.push_back(0);
      mesh.triangles[t] = {a, v, c};
      mesh.triangles.push_back({v, b, c});
      if (has_room || take_neighbour(mesh, c, v)) return true;
      mesh.triangles.pop_back();
      mesh.triangles[t] = corners;
      mesh.x.pop_back(), mesh.y.pop_back(), mesh.height.pop_back(), mesh.mark.pop_back();
      return false;
    }
  }
  return false;
}

}  // namespace cordillera::gpu
