#include "pipeline/tile/mesh_record.h"

namespace cordillera::pipeline {

proto::TileMeshRecord record_of_mesh(const proto::TileMesh& mesh) {
  proto::TileMeshRecord record;
  record.set_side(mesh.side);
  record.mutable_x()->Add(mesh.x.begin(), mesh.x.end());
  record.mutable_y()->Add(mesh.y.begin(), mesh.y.end());
  record.mutable_height()->Add(mesh.height.begin(), mesh.height.end());
  record.set_mark(std::string(mesh.mark.begin(), mesh.mark.end()));
  for (const auto& triangle : mesh.triangles) record.mutable_corner()->Add(triangle.begin(), triangle.end());
  return record;
}

std::optional<proto::TileMesh> mesh_of_record(const proto::TileMeshRecord& record) {
  const auto n = static_cast<std::size_t>(record.x_size());
  if (static_cast<std::size_t>(record.y_size()) != n || static_cast<std::size_t>(record.height_size()) != n ||
      record.mark().size() != n || record.corner_size() % 3 != 0) {
    return std::nullopt;
  }
  proto::TileMesh mesh;
  mesh.side = record.side();
  mesh.x.assign(record.x().begin(), record.x().end());
  mesh.y.assign(record.y().begin(), record.y().end());
  mesh.height.assign(record.height().begin(), record.height().end());
  mesh.mark.assign(record.mark().begin(), record.mark().end());
  for (int k = 0; k < record.corner_size(); k += 3) {
    const std::array<std::uint32_t, 3> triangle{record.corner(k), record.corner(k + 1), record.corner(k + 2)};
    if (triangle[0] >= n || triangle[1] >= n || triangle[2] >= n) return std::nullopt;
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

}  // namespace cordillera::pipeline
