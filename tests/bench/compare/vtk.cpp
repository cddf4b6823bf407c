// VTK's quadric decimation.
#include <vtkCellArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>

#include "tests/bench/compare/driver.h"

namespace {

using namespace cordillera;

void fill(vtkPolyData* out, const proto::TriangleMesh& mesh) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (std::size_t v = 0; v < mesh.vertices(); ++v) points->InsertNextPoint(mesh.x[v], mesh.y[v], mesh.z[v]);
  vtkNew<vtkCellArray> cells;
  for (const auto& t : mesh.triangles) {
    const vtkIdType corners[3] = {t[0], t[1], t[2]};
    cells->InsertNextCell(3, corners);
  }
  out->SetPoints(points);
  out->SetPolys(cells);
}

proto::TriangleMesh back(vtkPolyData* mesh) {
  proto::TriangleMesh out;
  for (vtkIdType v = 0; v < mesh->GetNumberOfPoints(); ++v) {
    double p[3];
    mesh->GetPoint(v, p);
    out.x.push_back(p[0]);
    out.y.push_back(p[1]);
    out.z.push_back(p[2]);
  }
  vtkNew<vtkIdList> corners;
  vtkCellArray* cells = mesh->GetPolys();
  for (cells->InitTraversal(); cells->GetNextCell(corners);) {
    std::array<std::uint32_t, 3> triangle{};
    for (vtkIdType k = 0; k < 3; ++k) triangle[static_cast<std::size_t>(k)] = static_cast<std::uint32_t>(corners->GetId(k));
    out.triangles.push_back(triangle);
  }
  return out;
}

}  // namespace

int main(int count, char** words) {
  return bench::drive(count, words, [](const bench::Task& task, bench::Stopwatch& watch) {
    vtkNew<vtkPolyData> mesh;
    fill(mesh, task.mesh);
    vtkNew<vtkQuadricDecimation> decimation;
    decimation->SetInputData(mesh);
    decimation->SetTargetReduction(1 - static_cast<double>(task.triangles) / static_cast<double>(task.mesh.triangles.size()));
    watch.start();
    decimation->Update();
    watch.stop();
    return back(decimation->GetOutput());
  });
}
