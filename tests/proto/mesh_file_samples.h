#pragma once
// Small mesh files as text and bytes, and what is in them.
#include <bit>
#include <cstring>
#include <sstream>
#include <string>

#include "proto/mesh_file/mesh_file.h"

namespace cordillera::proto {

inline Result<MeshFile> read_text(const std::string& text, const std::string& name = "in") {
  std::istringstream in(text);
  return read_mesh(in, name);
}

/// A roof over a unit square: five vertices, four triangles, with numbers that are no short decimals in binary.
inline TriangleMesh roof() {
  TriangleMesh mesh;
  mesh.x = {0, 1, 1, 0, 0.1};
  mesh.y = {0, 0, 1, 1, 1.0 / 3};
  mesh.z = {-0.0, 1e-300, 12345678.9012345, -2.5, 1e22};
  mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  return mesh;
}

inline std::string written(const TriangleMesh& mesh, const MeshEncoding& encoding) {
  std::ostringstream out;
  write_mesh(out, mesh, encoding);
  return out.str();
}

/// Bit for bit: -0.0 is not 0.0.
inline bool same(const TriangleMesh& a, const TriangleMesh& b) {
  const auto equal = [](const std::vector<double>& p, const std::vector<double>& q) {
    return p.size() == q.size() && std::memcmp(p.data(), q.data(), p.size() * sizeof(double)) == 0;
  };
  return equal(a.x, b.x) && equal(a.y, b.y) && equal(a.z, b.z) && a.triangles == b.triangles;
}

/// Bytes of values as a binary PLY has them.
class Bytes {
 public:
  explicit Bytes(std::endian order) : order_(order) {}
  template <class T>
  Bytes& add(T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    for (std::size_t k = 0; k < sizeof(T); ++k) text_ += bytes[order_ == std::endian::native ? k : sizeof(T) - 1 - k];
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::endian order_;
  std::string text_;
};

inline const std::string kOff = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 5\n3 0 1 2\n";
inline const std::string kPlyHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
inline const std::string kPly = kPlyHeader + "0 0 0\n1 0 0\n0 1 5\n3 0 1 2\n";
inline const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 5\nf 1 2 3\n";

}  // namespace cordillera::proto
