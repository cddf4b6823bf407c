#pragma once
// What the formats share; not for those who read and write files.
#include <ostream>
#include <string>

#include "proto/mesh_file/mesh_file.h"
#include "proto/mesh_file/mesh_source.h"
#include "proto/mesh_file/text_lines.h"
#include "proto/numbers.h"

namespace cordillera::proto {

Result<MeshFile> read_off(MeshSource& source);
Result<MeshFile> read_ply(MeshSource& source);
Result<MeshFile> read_obj(MeshSource& source);

/// Gathers small pieces; the stream gets large ones.
class MeshText {
 public:
  explicit MeshText(std::ostream& out) : out_(out) {}
  MeshText(const MeshText&) = delete;
  MeshText& operator=(const MeshText&) = delete;

  /// To append to; call once a row.
  std::string& row() {
    if (text_.size() > kPiece) write();
    return text_;
  }
  /// After the last row. No destructor does it: a stream may throw where the disk is full.
  void write() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

 private:
  static constexpr std::size_t kPiece = std::size_t{1} << 16;
  std::ostream& out_;
  std::string text_;
};

void write_off(MeshText& out, const TriangleMesh& mesh);
void write_ply(MeshText& out, const TriangleMesh& mesh, const MeshEncoding& encoding);
void write_obj(MeshText& out, const TriangleMesh& mesh, const MeshEncoding& encoding);

/// x, y, z with blanks between, as the fewest digits.
template <class T>
void append_position(std::string& text, const TriangleMesh& mesh, std::size_t vertex) {
  append_number(text, static_cast<T>(mesh.x[vertex]));
  append_number(text += ' ', static_cast<T>(mesh.y[vertex]));
  append_number(text += ' ', static_cast<T>(mesh.z[vertex]));
}

/// A row a vertex, then a row a triangle: "3 a b c". The body of OFF and of ascii PLY.
template <class T>
void write_rows(MeshText& out, const TriangleMesh& mesh) {
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    append_position<T>(out.row(), mesh, v);
    out.row() += '\n';
  }
  for (const auto& triangle : mesh.triangles) {
    std::string& row = out.row();
    row += '3';
    for (const std::uint32_t corner : triangle) append_number(row += ' ', corner);
    row += '\n';
  }
}

// What several formats complain of.
inline constexpr const char* kFiniteNumber = "a finite number that a double can hold";
inline constexpr const char* kOnlyTriangles = "triangles only: triangulate the mesh first";
inline constexpr std::uint64_t kMostVertices = 0xffffffff;

/// "triangle 3 has vertex 9, but there are 8 vertices, 0 to 7".
std::string out_of_range(std::uint64_t triangle, double index, std::uint64_t vertices);

}  // namespace cordillera::proto
