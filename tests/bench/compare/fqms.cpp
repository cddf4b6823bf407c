// Fast-Quadric-Mesh-Simplification: one header, with its mesh in globals.
#include <cfloat>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <Simplify.h>

#include "tests/bench/compare/driver.h"

int main(int count, char** words) {
  using namespace cordillera;
  return bench::drive(count, words, [](const bench::Task& task, bench::Stopwatch& watch) {
    for (std::size_t v = 0; v < task.mesh.vertices(); ++v) {
      Simplify::Vertex vertex{};
      vertex.p = vec3f(task.mesh.x[v], task.mesh.y[v], task.mesh.z[v]);
      Simplify::vertices.push_back(vertex);
    }
    for (const auto& t : task.mesh.triangles) {
      Simplify::Triangle triangle{};
      for (std::size_t k = 0; k < 3; ++k) triangle.v[k] = static_cast<int>(t[k]);
      Simplify::triangles.push_back(triangle);
    }
    watch.start();
    Simplify::simplify_mesh(static_cast<int>(task.triangles));
    watch.stop();
    proto::TriangleMesh out;
    for (const Simplify::Vertex& vertex : Simplify::vertices) {
      out.x.push_back(vertex.p.x);
      out.y.push_back(vertex.p.y);
      out.z.push_back(vertex.p.z);
    }
    for (const Simplify::Triangle& t : Simplify::triangles) {
      out.triangles.push_back(
          {static_cast<std::uint32_t>(t.v[0]), static_cast<std::uint32_t>(t.v[1]), static_cast<std::uint32_t>(t.v[2])});
    }
    return out;
  });
}
