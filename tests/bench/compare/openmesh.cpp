// OpenMesh's decimater with its quadric module.
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

#include "tests/bench/compare/driver.h"

namespace {

using namespace cordillera;
struct Doubles : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Doubles>;

Mesh from(const proto::TriangleMesh& mesh) {
  Mesh out;
  std::vector<Mesh::VertexHandle> vertices;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) vertices.push_back(out.add_vertex({mesh.x[v], mesh.y[v], mesh.z[v]}));
  for (const auto& t : mesh.triangles) out.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  return out;
}

proto::TriangleMesh back(Mesh& mesh) {
  mesh.garbage_collection();
  proto::TriangleMesh out;
  for (const auto v : mesh.vertices()) {
    const auto& p = mesh.point(v);
    out.x.push_back(p[0]);
    out.y.push_back(p[1]);
    out.z.push_back(p[2]);
  }
  for (const auto f : mesh.faces()) {
    std::array<std::uint32_t, 3> triangle{};
    std::size_t k = 0;
    for (const auto v : f.vertices()) triangle[k++] = static_cast<std::uint32_t>(v.idx());
    out.triangles.push_back(triangle);
  }
  return out;
}

}  // namespace

int main(int count, char** words) {
  return bench::drive(count, words, [](const bench::Task& task, bench::Stopwatch& watch) {
    Mesh mesh = from(task.mesh);
    mesh.request_face_normals();
    watch.start();
    OpenMesh::Decimater::DecimaterT<Mesh> decimater(mesh);
    OpenMesh::Decimater::ModQuadricT<Mesh>::Handle quadric;
    decimater.add(quadric);
    decimater.module(quadric).unset_max_err();
    if (!decimater.initialize()) throw std::runtime_error("the decimater cannot be initialised");
    decimater.decimate_to_faces(0, task.triangles);
    watch.stop();
    return back(mesh);
  });
}
