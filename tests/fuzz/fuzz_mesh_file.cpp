// OFF, PLY and OBJ: the first byte chooses nothing, the reader tells formats apart itself. What is read must survive being
// written.
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

#include "proto/mesh_file/mesh_file.h"

using namespace cordillera::proto;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  const auto file = read_mesh(in, "fuzz");
  if (!file) {
    if (file.problem().type.empty() || file.problem().detail.empty()) __builtin_trap();
    return 0;
  }
  std::ostringstream out;
  MeshEncoding encoding;
  encoding.format = MeshFormat::ply_little_endian;
  if (!write_mesh(out, file->mesh, encoding)) return 0;
  std::istringstream again(out.str());
  const auto copy = read_mesh(again, "copy");
  if (!copy || copy->mesh.triangles != file->mesh.triangles) __builtin_trap();
  return 0;
}
