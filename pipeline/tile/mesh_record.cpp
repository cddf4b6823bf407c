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

namespace {

proto::TileMeshRecord record_of(const proto::TileMesh& mesh, double max_error_m) {
  proto::TileMeshRecord record = record_of_mesh(mesh);
  record.set_max_error(max_error_m);
  return record;
}

void put(const Loose& loose, proto::TileMeshRecord& record) {
  gpu::MeshPoint last;
  for (const gpu::MeshPoint& p : loose.samples) {
    for (const std::int32_t step : {p.y - last.y, p.x - last.x, p.height - last.height}) record.add_loose(step);
    last = p;
  }
  if (loose.patches.triangles.empty()) return;
  *record.mutable_patches() = record_of(loose.patches, 0);
  record.mutable_patch_error()->Add(loose.patch_error_m.begin(), loose.patch_error_m.end());
}

/// False where the sum is no number of a lattice: the bytes are not ours.
bool add(std::int32_t step, std::int32_t& place) { return !__builtin_add_overflow(place, step, &place); }

std::optional<Loose> loose_of(const proto::TileMeshRecord& record) {
  Loose loose;
  loose.patches.side = record.side();
  if (record.loose_size() % 3 != 0) return std::nullopt;
  gpu::MeshPoint at;
  for (int k = 0; k < record.loose_size(); k += 3) {
    if (!add(record.loose(k + 1), at.x) || !add(record.loose(k), at.y) || !add(record.loose(k + 2), at.height))
      return std::nullopt;
    loose.samples.push_back(at);
  }
  if (!record.has_patches()) return loose;
  std::optional<proto::TileMesh> patches = mesh_of_record(record.patches());
  if (!patches || patches->triangles.size() != static_cast<std::size_t>(record.patch_error_size())) return std::nullopt;
  loose.patches = std::move(*patches);
  loose.patch_error_m.assign(record.patch_error().begin(), record.patch_error().end());
  return loose;
}

proto::TileMeshRecord record_of(const Surface& surface) {
  proto::TileMeshRecord record = record_of(surface.mesh, surface.max_error_m);
  put(surface.loose, record);
  return record;
}

std::optional<Surface> surface_of(const proto::TileMeshRecord& record) {
  std::optional<proto::TileMesh> mesh = mesh_of_record(record);
  std::optional<Loose> loose = loose_of(record);
  if (!mesh || !loose) return std::nullopt;
  return Surface{std::move(*mesh), record.max_error(), std::move(*loose)};
}

}  // namespace

std::string to_bytes(const BuiltTile& tile) {
  proto::TileMeshRecord record = record_of(tile.mesh, tile.max_error_m);
  put(tile.loose, record);
  if (tile.finer) *record.mutable_finer() = record_of(*tile.finer);
  record.set_uncovered(tile.measured.uncovered);
  return record.SerializeAsString();
}

proto::Result<BuiltTile> tile_from_bytes(const proto::TileAddress& tile, const std::string& bytes) {
  const proto::Problem damaged{"store-damaged", "a stored tile mesh cannot be read", "a dataset built anew", ""};
  proto::TileMeshRecord record;
  if (!record.ParseFromString(bytes)) return damaged;
  std::optional<Surface> surface = surface_of(record);
  if (!surface) return damaged;
  BuiltTile built;
  built.tile = tile;
  built.max_error_m = surface->max_error_m;
  built.measured.uncovered = record.uncovered();
  built.mesh = std::move(surface->mesh);
  built.loose = std::move(surface->loose);
  if (!record.has_finer()) return built;
  built.finer = surface_of(record.finer());
  if (!built.finer) return damaged;
  return built;
}

}  // namespace cordillera::pipeline
