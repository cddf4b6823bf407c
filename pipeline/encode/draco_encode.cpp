#include <draco/compression/encode.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/encode.h"

namespace cordillera::pipeline {
namespace {

constexpr int kNormalBits = 10;
// Of up and east, beside which the terrain's own normals have eight bits: they change by little, so more bits cost next to
// nothing.
constexpr int kFrameBits = 12;
// Draco's entropy coder counts symbols in a table as long as the greatest one. Tiles a dozen levels above the finest would need
// gigabytes of it; there are a handful of them in a dataset, so their integers go in as they are.
constexpr std::int32_t kMaxCodedSide = 1 << 20;

void leave_uncoded(draco::Encoder& encoder) { encoder.options().SetGlobalBool("use_built_in_attribute_compression", false); }

template <class Scalar>
constexpr draco::DataType draco_type() {
  return std::is_same_v<Scalar, float> ? draco::DT_FLOAT32 : draco::DT_INT32;
}

// Values are not merged: two fans that touch in one position stay two vertices.
template <class Scalar, std::size_t count>
int add_attribute(draco::Mesh& mesh, draco::GeometryAttribute::Type type, const std::vector<std::array<Scalar, count>>& values) {
  draco::GeometryAttribute shape;
  shape.Init(type, nullptr, count, draco_type<Scalar>(), false, sizeof(values[0]), 0);
  const int id = mesh.AddAttribute(shape, true, static_cast<std::uint32_t>(values.size()));
  mesh.attribute(id)->buffer()->Write(0, values.data(), values.size() * sizeof(values[0]));
  return id;
}

void add_faces(draco::Mesh& mesh, const std::vector<Triangle>& triangles) {
  mesh.SetNumFaces(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const Triangle& c = triangles[t];
    mesh.SetFace(draco::FaceIndex(t), {draco::PointIndex(c[0]), draco::PointIndex(c[1]), draco::PointIndex(c[2])});
  }
}

std::string encode(draco::Encoder& encoder, const draco::Mesh& mesh, int speed) {
  encoder.SetSpeedOptions(speed, speed);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeMeshToBuffer(mesh, &buffer);
  if (!status.ok()) throw std::logic_error("Draco refused a tile: " + status.error_msg_string());
  return {buffer.data(), buffer.size()};
}

}  // namespace

std::string draco_encode(const LatticeMesh& mesh, int speed) {
  draco::Mesh out;
  out.set_num_points(static_cast<std::uint32_t>(mesh.points.size()));
  add_attribute(out, draco::GeometryAttribute::POSITION, mesh.points);
  add_faces(out, mesh.triangles);
  auto metadata = std::make_unique<draco::GeometryMetadata>();
  metadata->AddEntryInt("z", mesh.z);
  metadata->AddEntryInt("x", mesh.x);
  metadata->AddEntryInt("y", mesh.y);
  metadata->AddEntryInt("side", mesh.side);
  metadata->AddEntryDouble("height_step", mesh.height_step);
  if (mesh.web_mercator) metadata->AddEntryString("tile_matrix_set", kWebMercator);
  out.AddMetadata(std::move(metadata));
  draco::Encoder encoder;
  if (mesh.side > kMaxCodedSide) leave_uncoded(encoder);
  return encode(encoder, out, speed);
}

namespace {

// Draco keeps these numbers as text with six decimals. From -1 to 1 a tangent's last number comes back as exactly 1; texture
// coordinates may be a ten-thousandth of a pixel off.
void quantise_tangents(draco::Encoder& encoder) {
  constexpr float kLow[4] = {-1, -1, -1, -1};
  encoder.SetAttributeExplicitQuantization(draco::GeometryAttribute::GENERIC, kFrameBits, 4, kLow, 2);
}
void quantise_texcoords(draco::Encoder& encoder) {
  constexpr float kMapSide = kNormalMapSide, kFirst[2] = {0.5F / kMapSide, 0.5F / kMapSide};
  constexpr int kBits = std::bit_width(static_cast<unsigned>(kPlacesAcross));
  constexpr float kPlace = (kMapSide - 1) / kMapSide / kPlacesAcross;
  encoder.SetAttributeExplicitQuantization(draco::GeometryAttribute::TEX_COORD, kBits, 2, kFirst, kPlace * ((1 << kBits) - 1));
}

/// Beyond what the grid has bits for.
bool reaches_beyond(const LitSurface& surface, const FloatGrid& grid) {
  const float most = grid.step * static_cast<float>(1 << (grid.bits - 1));
  return std::any_of(surface.positions.begin(), surface.positions.end(), [most](const std::array<float, 3>& p) {
    return std::any_of(p.begin(), p.end(), [most](float c) { return std::abs(c) >= most; });
  });
}

}  // namespace

std::string draco_encode(const LitSurface& surface, const FloatGrid& grid) {
  draco::Mesh out;
  out.set_num_points(static_cast<std::uint32_t>(surface.positions.size()));
  add_attribute(out, draco::GeometryAttribute::POSITION, surface.positions);
  const bool framed = !surface.tangents.empty();
  if (!surface.normals.empty()) add_attribute(out, draco::GeometryAttribute::NORMAL, surface.normals);
  if (framed) add_attribute(out, draco::GeometryAttribute::GENERIC, surface.tangents);
  if (!surface.texcoords.empty()) add_attribute(out, draco::GeometryAttribute::TEX_COORD, surface.texcoords);
  add_faces(out, surface.triangles);
  draco::Encoder encoder;
  // One origin and one range for the three axes. Both are exact in float32, and so is range / (2^bits - 1) = step.
  const float low = -grid.step * static_cast<float>(1 << (grid.bits - 1));
  const float origin[3] = {low, low, low};
  const float range = grid.step * static_cast<float>((1 << grid.bits) - 1);
  encoder.SetAttributeExplicitQuantization(draco::GeometryAttribute::POSITION, grid.bits, 3, origin, range);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::NORMAL, framed ? kFrameBits : kNormalBits);
  if (framed) quantise_tangents(encoder);
  if (!surface.texcoords.empty()) quantise_texcoords(encoder);
  if (reaches_beyond(surface, grid)) leave_uncoded(encoder);
  return encode(encoder, out, kDracoSpeed);
}

}  // namespace cordillera::pipeline
