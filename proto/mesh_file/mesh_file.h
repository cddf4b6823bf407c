#pragma once
// Mesh files of other programs: OFF, PLY (ascii, binary of either byte order) and OBJ, read and written in one pass. Beside the
// mesh itself a reader or writer holds one buffer and one token, whatever the file claims to be.
//
// Read: vertices and triangles. Skipped: comments, colours, normals, texture coordinates, edges, elements and properties (lists
// too) that nobody here knows. Refused, with the line or byte: a file that ends early or goes on after its end, what is no number
// or not finite, an index out of range, a polygon that is not a triangle. Elements are counted from 0, in OBJ from 1, as the
// formats do.
#include <iosfwd>
#include <string>
#include <vector>

#include "proto/mesh_file/triangle_mesh.h"
#include "proto/result.h"

namespace cordillera::proto {

enum class MeshFormat { off, ply_ascii, ply_little_endian, ply_big_endian, obj };
/// How a PLY says that it stores coordinates. OFF and OBJ say nothing and count as float64.
enum class CoordinateType { float32, float64 };

struct MeshEncoding {
  MeshFormat format = MeshFormat::ply_little_endian;
  CoordinateType coordinates = CoordinateType::float64;
  std::vector<std::string> comments = {};  ///< lines at the head of a PLY or OBJ; readers leave them out
};

struct MeshFile {
  TriangleMesh mesh;
  MeshEncoding encoding;  ///< what the file was; float32 only where every value of mesh is one
};

/// "OFF", "PLY (ascii)" and so on.
const char* name_of(MeshFormat format);

/// name: what errors call the file. Its ending decides only where the content does not.
Result<MeshFile> read_mesh(std::istream& in, const std::string& name);
Result<MeshFile> read_mesh_file(const std::string& path);

/// What to write a file called path as, made from a source: OFF, OBJ or PLY by the name's ending; a PLY as the source's PLY was,
/// else binary little endian with doubles.
Result<MeshEncoding> encoding_for(const std::string& path, const MeshEncoding& source);

/// What a reader of such a file will get: with float32 coordinates the nearest floats, else the mesh itself.
TriangleMesh as_written(TriangleMesh mesh, const MeshEncoding& encoding);

/// Text has the fewest digits that read back as the same number, so reading and writing again gives the same bytes.
/// mesh: finite coordinates; indices in range. False: the stream failed.
bool write_mesh(std::ostream& out, const TriangleMesh& mesh, const MeshEncoding& encoding);
/// The file appears under its name when it is whole, or not at all; an earlier one is replaced.
Result<void> write_mesh_file(const std::string& path, const TriangleMesh& mesh, const MeshEncoding& encoding);

}  // namespace cordillera::proto
