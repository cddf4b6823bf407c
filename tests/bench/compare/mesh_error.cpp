// mesh_error REFERENCE MESH: how far MESH is from the vertices of REFERENCE along z, and what is broken in it; one line of JSON.
// The judge of every simplifier in the comparison, ours too.
#include <algorithm>
#include <cstdio>
#include <thread>

#include "gpu/fit/vertical_error.h"
#include "proto/cores.h"
#include "proto/mesh_file/mesh_file.h"

namespace {

using namespace cordillera;
using proto::TriangleMesh;

/// Triangles that do not look up, if most do.
std::size_t flipped(const TriangleMesh& mesh) {
  std::size_t up = 0, down = 0;
  for (const auto& t : mesh.triangles) {
    const double ux = mesh.x[t[1]] - mesh.x[t[0]], uy = mesh.y[t[1]] - mesh.y[t[0]];
    const double vx = mesh.x[t[2]] - mesh.x[t[0]], vy = mesh.y[t[2]] - mesh.y[t[0]];
    const double area = ux * vy - uy * vx;
    up += area > 0;
    down += area < 0;
  }
  return mesh.triangles.size() - std::max(up, down);
}

/// Edges of more than two triangles.
std::size_t crowded_edges(const TriangleMesh& mesh) {
  std::vector<std::uint64_t> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
      edges.push_back(std::uint64_t{low} << 32 | high);
    }
  }
  std::sort(edges.begin(), edges.end());
  std::size_t crowded = 0;
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t next = first;
    while (next < edges.size() && edges[next] == edges[first]) ++next;
    crowded += next - first > 2;
    first = next;
  }
  return crowded;
}

std::uint32_t most_triangles_at_a_vertex(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> valence(mesh.vertices());
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t corner : t) ++valence[corner];
  }
  return valence.empty() ? 0 : *std::max_element(valence.begin(), valence.end());
}

/// A thread for each share.
void at_once(std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<std::jthread> threads;
  for (std::size_t k = 0; k < count; ++k) threads.emplace_back([&work, k] { work(k); });
}

}  // namespace

int main(int count, char** words) {
  if (count != 3) {
    std::fprintf(stderr, "usage: %s REFERENCE MESH\n", words[0]);
    return 2;
  }
  const auto reference = proto::read_mesh_file(words[1]), mesh = proto::read_mesh_file(words[2]);
  for (const auto* file : {&reference, &mesh}) {
    if (*file) continue;
    std::fprintf(stderr, "%s\n", file->problem().line().c_str());
    return 1;
  }
  const TriangleMesh& points = reference->mesh;
  const auto error = gpu::vertical_error(mesh->mesh, {points.x, points.y, points.z}, proto::usable_cores(), at_once);
  std::printf(
      "{\"vertices\": %zu, \"triangles\": %zu, \"rmse_m\": %.9g, \"max_error_m\": %.9g, \"uncovered\": %llu, \"flipped\": %zu, "
      "\"crowded_edges\": %zu, \"max_valence\": %u}\n",
      mesh->mesh.vertices(), mesh->mesh.triangles.size(), error.rmse, error.max, static_cast<unsigned long long>(error.uncovered),
      flipped(mesh->mesh), crowded_edges(mesh->mesh), most_triangles_at_a_vertex(mesh->mesh));
  return 0;
}
