#include <draco/compression/decode.h>

#include <cmath>

#include "pipeline/encode/draco_mesh.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {
namespace {

proto::Problem not_a_tile(const std::string& why) {
  return {"tile-damaged", "not a Draco tile mesh: " + why, "bytes of a tile that Cordillera wrote", ""};
}

template <class Scalar, std::size_t count>
bool read_attribute(const draco::Mesh& mesh, draco::GeometryAttribute::Type type,
                    std::vector<std::array<Scalar, count>>& values) {
  const draco::PointAttribute* attribute = mesh.GetNamedAttribute(type);
  if (attribute == nullptr || attribute->num_components() != count) return false;
  values.resize(mesh.num_points());
  for (std::uint32_t p = 0; p < mesh.num_points(); ++p) {
    if (!attribute->ConvertValue<Scalar, count>(attribute->mapped_index(draco::PointIndex(p)), values[p].data())) return false;
  }
  return true;
}

std::vector<Triangle> read_faces(const draco::Mesh& mesh) {
  std::vector<Triangle> triangles(mesh.num_faces());
  for (std::uint32_t t = 0; t < mesh.num_faces(); ++t) {
    const draco::Mesh::Face& face = mesh.face(draco::FaceIndex(t));
    triangles[t] = {face[0].value(), face[1].value(), face[2].value()};
  }
  return triangles;
}

proto::Result<std::shared_ptr<draco::Mesh>> decode(std::string_view bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto mesh = decoder.DecodeMeshFromBuffer(&buffer);
  if (!mesh.ok()) return not_a_tile(mesh.status().error_msg_string());
  return std::shared_ptr<draco::Mesh>(std::move(mesh).value());
}

}  // namespace

proto::Result<LatticeMesh> draco_decode_lattice(std::string_view bytes) {
  const auto mesh = decode(bytes);
  if (!mesh) return mesh.problem();
  LatticeMesh out;
  const draco::GeometryMetadata* metadata = (*mesh)->GetMetadata();
  if (metadata == nullptr || !metadata->GetEntryInt("z", &out.z) || !metadata->GetEntryInt("x", &out.x) ||
      !metadata->GetEntryInt("y", &out.y) || !metadata->GetEntryInt("side", &out.side) ||
      !metadata->GetEntryDouble("height_step", &out.height_step)) {
    return not_a_tile("z, x, y, side or height_step is missing from its metadata");
  }
  std::string matrix_set;
  out.web_mercator = metadata->GetEntryString("tile_matrix_set", &matrix_set) && matrix_set == kWebMercator;
  const draco::PointAttribute* position = (*mesh)->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (position == nullptr || position->data_type() != draco::DT_INT32) return not_a_tile("its positions are no integers");
  if (!read_attribute(**mesh, draco::GeometryAttribute::POSITION, out.points)) return not_a_tile("it has no positions");
  out.triangles = read_faces(**mesh);
  return out;
}

LatticeMesh in_mesh_steps(LatticeMesh mesh) {
  const auto steps = static_cast<std::int32_t>(std::lround(mesh.height_step / proto::kHeightStep_m));
  for (auto& point : mesh.points) point[2] *= steps;
  mesh.height_step = proto::kHeightStep_m;
  return mesh;
}

proto::TileMesh tile_mesh_of(const LatticeMesh& mesh) {
  proto::TileMesh out;
  out.side = mesh.side;
  for (const auto& [u, v, h] : mesh.points) {
    out.x.push_back(u);
    out.y.push_back(v);
    out.height.push_back(h);
  }
  out.mark.assign(mesh.points.size(), 0);
  out.triangles = mesh.triangles;
  return out;
}

proto::Result<LitSurface> draco_decode_lit(std::string_view bytes) {
  const auto mesh = decode(bytes);
  if (!mesh) return mesh.problem();
  LitSurface out;
  if (!read_attribute(**mesh, draco::GeometryAttribute::POSITION, out.positions)) return not_a_tile("it has no positions");
  if (!read_attribute(**mesh, draco::GeometryAttribute::NORMAL, out.normals)) out.normals.clear();
  if (!read_attribute(**mesh, draco::GeometryAttribute::GENERIC, out.tangents)) out.tangents.clear();
  if (!read_attribute(**mesh, draco::GeometryAttribute::TEX_COORD, out.texcoords)) out.texcoords.clear();
  out.triangles = read_faces(**mesh);
  return out;
}

}  // namespace cordillera::pipeline
