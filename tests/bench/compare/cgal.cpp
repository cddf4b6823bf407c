// CGAL's edge collapse; variants lindstrom-turk (its default) and, where Eigen is installed, garland-heckbert.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#if __has_include(<Eigen/Dense>)
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_policies.h>
#define CORDILLERA_HAS_GARLAND_HECKBERT
#endif
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include "tests/bench/compare/driver.h"

namespace {

using namespace cordillera;
namespace SMS = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

/// CGAL 5.5 counts edges only.
struct FacesLeft {
  std::size_t target;
  template <class Cost, class Profile>
  bool operator()(const Cost&, const Profile& profile, std::size_t, std::size_t) const {
    return profile.surface_mesh().number_of_faces() <= target;
  }
};

Mesh from(const proto::TriangleMesh& mesh) {
  Mesh out;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) out.add_vertex({mesh.x[v], mesh.y[v], mesh.z[v]});
  using Vertex = Mesh::Vertex_index;
  for (const auto& t : mesh.triangles) out.add_face(Vertex(t[0]), Vertex(t[1]), Vertex(t[2]));
  return out;
}

void garland_heckbert([[maybe_unused]] Mesh& mesh, [[maybe_unused]] const FacesLeft& stop) {
#ifdef CORDILLERA_HAS_GARLAND_HECKBERT
  const SMS::GarlandHeckbert_policies<Mesh, Kernel> policies(mesh);
  SMS::edge_collapse(mesh, stop, CGAL::parameters::get_cost(policies.get_cost()).get_placement(policies.get_placement()));
#else
  throw std::runtime_error("CGAL's Garland-Heckbert policies need Eigen (libeigen3-dev)");
#endif
}

proto::TriangleMesh back(Mesh& mesh) {
  mesh.collect_garbage();
  proto::TriangleMesh out;
  for (const auto v : mesh.vertices()) {
    out.x.push_back(mesh.point(v).x());
    out.y.push_back(mesh.point(v).y());
    out.z.push_back(mesh.point(v).z());
  }
  for (const auto f : mesh.faces()) {
    std::array<std::uint32_t, 3> triangle{};
    std::size_t k = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) triangle[k++] = v.idx();
    out.triangles.push_back(triangle);
  }
  return out;
}

}  // namespace

int main(int count, char** words) {
  return bench::drive(count, words, [](const bench::Task& task, bench::Stopwatch& watch) {
    Mesh mesh = from(task.mesh);
    const FacesLeft stop{task.triangles};
    watch.start();
    if (task.variant == "garland-heckbert") {
      garland_heckbert(mesh, stop);
    } else {
      SMS::edge_collapse(mesh, stop);
    }
    watch.stop();
    return back(mesh);
  });
}
