#include "gpu/fit/check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace cordillera::gpu::fit {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

proto::Problem broken(std::string detail) {
  return {"mesh-broken", std::move(detail), "x, y and z of every vertex, and triangles of three different vertices", "mesh"};
}

double twice_area(const HeightMesh& mesh, const Triangle& t) {
  return (mesh.x[t[1]] - mesh.x[t[0]]) * (mesh.y[t[2]] - mesh.y[t[0]]) -
         (mesh.y[t[1]] - mesh.y[t[0]]) * (mesh.x[t[2]] - mesh.x[t[0]]);
}

std::optional<proto::Problem> check_vertices(const HeightMesh& mesh) {
  const std::size_t count = mesh.vertices();
  if (mesh.y.size() != count || mesh.z.size() != count) return broken("the arrays x, y and z differ in length");
  if (count > std::size_t{1} << 28) return broken("the mesh has " + std::to_string(count) + " vertices; at most 2^28 are taken");
  for (std::size_t v = 0; v < count; ++v) {
    if (std::isfinite(mesh.x[v]) && std::isfinite(mesh.y[v]) && std::isfinite(mesh.z[v])) continue;
    return proto::Problem{"mesh-not-finite", "vertex " + std::to_string(v) + " holds NaN or infinity", "finite coordinates",
                          "mesh"};
  }
  return {};
}

/// Follows the triangles around a vertex from a border or from anywhere; does it meet them all?
bool is_one_fan(std::vector<std::array<std::uint32_t, 2>> wedges) {
  std::size_t start = 0;
  for (std::size_t i = 0; i < wedges.size(); ++i) {
    if (std::none_of(wedges.begin(), wedges.end(), [&](const auto& other) { return other[1] == wedges[i][0]; })) start = i;
  }
  std::swap(wedges[0], wedges[start]);
  for (std::size_t i = 1; i < wedges.size(); ++i) {
    const auto next = std::find_if(wedges.begin() + static_cast<std::ptrdiff_t>(i), wedges.end(),
                                   [&](const auto& w) { return w[0] == wedges[i - 1][1]; });
    if (next == wedges.end()) return false;
    std::swap(*next, wedges[i]);
  }
  return true;
}

}  // namespace

std::optional<proto::Problem> check_triangles(const HeightMesh& mesh, bool& clockwise) {
  if (auto problem = check_vertices(mesh)) return problem;
  if (mesh.triangles.empty()) return broken("the mesh has no triangles");
  clockwise = false;
  std::vector<bool> used(mesh.vertices());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corner = mesh.triangles[t];
    for (const std::uint32_t v : corner) {
      if (v >= mesh.vertices()) {
        return broken("triangle " + std::to_string(t) + " names vertex " + std::to_string(v) + "; there are " +
                      std::to_string(mesh.vertices()));
      }
      used[v] = true;
    }
    const double area = twice_area(mesh, corner);
    if (t == 0) clockwise = area < 0;
    if (clockwise ? area < 0 : area > 0) continue;
    return proto::Problem{
        "mesh-not-height-field",
        "triangle " + std::to_string(t) + (area == 0 ? " has no area in the plan" : " turns the other way than triangle 0"),
        "triangles that all turn the same way seen from above", "mesh"};
  }
  const auto unused = std::find(used.begin(), used.end(), false);
  if (unused != used.end()) return broken("vertex " + std::to_string(unused - used.begin()) + " belongs to no triangle");
  return {};
}

std::optional<proto::Problem> find_non_manifold(const HeightMesh& mesh) {
  std::map<std::array<std::uint32_t, 2>, std::size_t> owner;
  std::vector<std::vector<std::array<std::uint32_t, 2>>> wedges(mesh.vertices());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& corner = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = corner[k], b = corner[(k + 1) % 3];
      wedges[a].push_back({b, corner[(k + 2) % 3]});
      const auto [at, is_new] = owner.insert({{a, b}, t});
      if (is_new) continue;
      return proto::Problem{"mesh-not-manifold",
                            "triangles " + std::to_string(at->second) + " and " + std::to_string(t) +
                                " lie on the same side of the edge from vertex " + std::to_string(a) + " to vertex " +
                                std::to_string(b),
                            "one or two triangles at every edge", "mesh"};
    }
  }
  for (std::size_t v = 0; v < wedges.size(); ++v) {
    if (is_one_fan(wedges[v])) continue;
    return proto::Problem{"mesh-not-manifold", "the triangles at vertex " + std::to_string(v) + " form more than one fan",
                          "triangles that follow each other around every vertex", "mesh"};
  }
  return {};
}

std::optional<proto::Problem> find_step(const HeightMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.vertices());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tie(mesh.x[a], mesh.y[a], a) < std::tie(mesh.x[b], mesh.y[b], b);
  });
  std::optional<std::array<std::uint32_t, 2>> first;
  for (std::size_t k = 1; k < order.size(); ++k) {
    const std::uint32_t a = order[k - 1], b = order[k];
    if (mesh.x[a] != mesh.x[b] || mesh.y[a] != mesh.y[b] || mesh.z[a] == mesh.z[b]) continue;
    if (!first || a < first->front()) first = {a, b};
  }
  if (!first) return {};
  return proto::Problem{
      "mesh-not-height-field",
      "vertex " + std::to_string(first->front()) + " and vertex " + std::to_string(first->back()) + " lie above each other",
      "a surface that covers no point of the plan twice", "mesh"};
}

proto::Problem too_many_edges(const HeightMesh& mesh) {
  // Around an inner vertex each neighbour is in two triangles, so that nothing is left of them.
  std::vector<std::uint32_t> triangles(mesh.vertices()), left(mesh.vertices());
  for (const Triangle& corner : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++triangles[corner[k]];
      left[corner[k]] ^= (corner[(k + 1) % 3] + 1) ^ (corner[(k + 2) % 3] + 1);
    }
  }
  std::size_t most = 0;
  const auto edges = [&](std::size_t v) { return triangles[v] + (left[v] != 0 ? 1 : 0); };
  for (std::size_t v = 1; v < mesh.vertices(); ++v) most = edges(v) > edges(most) ? v : most;
  return {"mesh-not-manifold", "vertex " + std::to_string(most) + " has " + std::to_string(edges(most)) + " edges",
          "at most 255 edges at a vertex", "mesh"};
}

std::optional<proto::Problem> find_crowd(const HeightMesh& mesh, double company) {
  constexpr double kMostPairs = 1e8, kCrowd = 100;  // half a minute of looking for neighbours
  if (company <= kCrowd || company * static_cast<double>(mesh.vertices()) <= kMostPairs) return {};
  const auto middle = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  const double x = middle(mesh.x), y = middle(mesh.y);
  const auto away = [&](std::size_t v) { return std::max(std::abs(mesh.x[v] - x), std::abs(mesh.y[v] - y)); };
  std::size_t farthest = 0;
  for (std::size_t v = 1; v < mesh.vertices(); ++v) farthest = away(v) > away(farthest) ? v : farthest;
  return proto::Problem{
      "mesh-too-scattered",
      "nearly all vertices lie in a small part of the mesh; vertex " + std::to_string(farthest) + " is the farthest from there",
      "a mesh without it, or the mesh's parts one by one", "mesh"};
}

proto::Result<std::uint64_t> triangles_wanted(const MeshTarget& target, std::uint64_t triangles) {
  const auto refuse = [&](const char* what, const char* accepted) {
    return proto::Problem{"bad-target", std::string(what) + " is " + std::to_string(target.value), accepted, what};
  };
  switch (target.kind) {
    case MeshTarget::Kind::triangles:
      if (!(target.value >= 1 && target.value < 1e15)) return refuse("triangles", "1 or more");
      return static_cast<std::uint64_t>(target.value);
    case MeshTarget::Kind::keep:
      if (!(target.value > 0 && target.value <= 1)) return refuse("keep", "more than 0, at most 1");
      return std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(target.value * static_cast<double>(triangles))));
    case MeshTarget::Kind::error_m:
      if (!(target.value >= 0 && std::isfinite(target.value))) return refuse("error", "0 or more metres");
      return std::uint64_t{0};
  }
  return refuse("target", "triangles, keep, error");
}

}  // namespace cordillera::gpu::fit
