// PLY as it is written: vertices and triangles, nothing else.
#include <algorithm>
#include <array>
#include <bit>

#include "proto/mesh_file/formats.h"

namespace cordillera::proto {
namespace {

template <class T>
void append_bytes(std::string& to, T value, bool swapped) {
  auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if (swapped) std::reverse(bytes.begin(), bytes.end());
  to.append(bytes.data(), bytes.size());
}

/// Many readers know only int.
bool int_will_do(const TriangleMesh& mesh) { return mesh.vertices() <= 0x7fffffff; }

std::string header_of(const TriangleMesh& mesh, const MeshEncoding& encoding) {
  const std::string real = encoding.coordinates == CoordinateType::float32 ? "float" : "double";
  std::string text = "ply\nformat ";
  text += encoding.format == MeshFormat::ply_ascii        ? "ascii"
          : encoding.format == MeshFormat::ply_big_endian ? "binary_big_endian"
                                                          : "binary_little_endian";
  text += " 1.0\n";
  for (const std::string& comment : encoding.comments) text += "comment " + comment + "\n";
  text += "element vertex " + std::to_string(mesh.vertices()) + "\n";
  for (const char* axis : {"x", "y", "z"}) text += "property " + real + " " + axis + "\n";
  text += "element face " + std::to_string(mesh.triangles.size()) + "\n";
  text += std::string("property list uchar ") + (int_will_do(mesh) ? "int" : "uint") + " vertex_indices\nend_header\n";
  return text;
}

template <class Real>
void write_binary(MeshText& out, const TriangleMesh& mesh, bool swapped) {
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    std::string& row = out.row();
    for (const auto* axis : {&mesh.x, &mesh.y, &mesh.z}) append_bytes(row, static_cast<Real>((*axis)[v]), swapped);
  }
  for (const auto& triangle : mesh.triangles) {
    std::string& row = out.row();
    row.push_back(3);
    for (const std::uint32_t corner : triangle) append_bytes(row, corner, swapped);
  }
}

template <class Real>
void write_body(MeshText& out, const TriangleMesh& mesh, MeshFormat format) {
  if (format == MeshFormat::ply_ascii) return write_rows<Real>(out, mesh);
  write_binary<Real>(out, mesh, (format == MeshFormat::ply_big_endian) != (std::endian::native == std::endian::big));
}

}  // namespace

void write_ply(MeshText& out, const TriangleMesh& mesh, const MeshEncoding& encoding) {
  out.row() += header_of(mesh, encoding);
  if (encoding.coordinates == CoordinateType::float32) return write_body<float>(out, mesh, encoding.format);
  write_body<double>(out, mesh, encoding.format);
}

}  // namespace cordillera::proto
