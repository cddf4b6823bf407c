#include "pipeline/mesh_record.h"

namespace cordillera::pipeline {

namespace {

proto::TileMeshRecord record_of(const proto::TileMesh& mesh, double max_error_m) {
  proto::TileMeshRecord record;
  record.set_side(mesh.side);
  record.mutable_x()->Add(mesh.x.begin(), mesh.x.end());
  record.mutable_y()->Add(mesh.y.begin(), mesh.y.end());
  record.mutable_height()->Add(mesh.height.begin(), mesh.height.end());
  record.set_mark(std::string(mesh.mark.begin(), mesh.mark.end()));
  for (const auto& triangle : mesh.triangles) record.mutable_corner()->Add(triangle.begin(), triangle.end());
  record.set_max_error(max_error_m);
  return record;
}

std::optional<proto::TileMesh> mesh_of(const proto::TileMeshRecord& record) {
  const auto n = static_cast<std::size_t>(record.x_size());
  if (static_cast<std::size_t>(record.y_size()) != n || static_cast<std::size_t>(record.height_size()) != n || record.mark().size() != n ||
      record.corner_size() % 3 != 0) {
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

}  // namespace

std::string to_bytes(const BuiltTile& tile) {
  proto::TileMeshRecord record = record_of(tile.mesh, tile.surface_error_m);
  if (tile.finer) *record.mutable_finer() = record_of(tile.finer->mesh, tile.finer->max_error_m);
  record.set_uncovered(tile.measured.uncovered);
  return record.SerializeAsString();
}

proto::Result<BuiltTile> tile_from_bytes(const proto::TileAddress& tile, const std::string& bytes) {
  const proto::Problem damaged{"store-damaged", "a stored tile mesh cannot be read", "a dataset built anew", ""};
  proto::TileMeshRecord record;
  if (!record.ParseFromString(bytes)) return damaged;
  std::optional<proto::TileMesh> mesh = mesh_of(record);
  if (!mesh) return damaged;
  BuiltTile built;
  built.tile = tile;
  built.max_error_m = built.surface_error_m = record.max_error();
  built.measured.uncovered = record.uncovered();
  built.mesh = std::move(*mesh);
  if (record.has_finer()) {
    std::optional<proto::TileMesh> finer = mesh_of(record.finer());
    if (!finer) return damaged;
    built.finer = Surface{std::move(*finer), record.finer().max_error()};
  }
  return built;
}

}  // namespace cordillera::pipeline
