#include "pipeline/mesh_record.h"

namespace cordillera::pipeline {

std::string to_bytes(const BuiltTile& tile) {
  const proto::TileMesh& mesh = tile.mesh;
  proto::TileMeshRecord record;
  record.set_side(mesh.side);
  record.mutable_x()->Add(mesh.x.begin(), mesh.x.end());
  record.mutable_y()->Add(mesh.y.begin(), mesh.y.end());
  record.mutable_height()->Add(mesh.height.begin(), mesh.height.end());
  record.set_mark(std::string(mesh.mark.begin(), mesh.mark.end()));
  for (const auto& triangle : mesh.triangles) record.mutable_corner()->Add(triangle.begin(), triangle.end());
  record.set_max_error(tile.max_error_m);
  return record.SerializeAsString();
}

proto::Result<BuiltTile> tile_from_bytes(const proto::TileAddress& tile, const std::string& bytes) {
  const proto::Problem damaged{"store-damaged", "a stored tile mesh cannot be read", "a dataset built anew", ""};
  proto::TileMeshRecord record;
  if (!record.ParseFromString(bytes)) return damaged;
  const auto n = static_cast<std::size_t>(record.x_size());
  if (static_cast<std::size_t>(record.y_size()) != n || static_cast<std::size_t>(record.height_size()) != n || record.mark().size() != n ||
      record.corner_size() % 3 != 0) {
    return damaged;
  }
  BuiltTile built;
  built.tile = tile;
  built.max_error_m = record.max_error();
  built.mesh.side = record.side();
  built.mesh.x.assign(record.x().begin(), record.x().end());
  built.mesh.y.assign(record.y().begin(), record.y().end());
  built.mesh.height.assign(record.height().begin(), record.height().end());
  built.mesh.mark.assign(record.mark().begin(), record.mark().end());
  for (int k = 0; k < record.corner_size(); k += 3) {
    const std::array<std::uint32_t, 3> triangle{record.corner(k), record.corner(k + 1), record.corner(k + 2)};
    if (triangle[0] >= n || triangle[1] >= n || triangle[2] >= n) return damaged;
    built.mesh.triangles.push_back(triangle);
  }
  return built;
}

}  // namespace cordillera::pipeline
