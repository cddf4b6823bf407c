#include "proto/mesh_file/mesh_file.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "proto/letters.h"
#include "proto/mesh_file/formats.h"
#include "proto/paths.h"

namespace cordillera::proto {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEndings = ".ply, .off or .obj";

/// ".ply" of "Hill.PLY".
std::string ending_of(const std::string& name) { return lower(fs::path(name).extension().string()); }

/// Next to the file, so that the rename is within one file system.
fs::path temporary_for(const fs::path& path) {
  return path.parent_path() /
         std::string(".").append(path.filename().string()).append(".").append(std::to_string(getpid())).append(".partial");
}

Problem unwritable(const std::string& path, const std::string& why) {
  return Problem{"output-failed", "cannot write " + path + ": " + why, "a file in a folder that can be written", "--output"};
}

}  // namespace

const char* name_of(MeshFormat format) {
  switch (format) {
    case MeshFormat::off: return "OFF";
    case MeshFormat::ply_ascii: return "PLY (ascii)";
    case MeshFormat::ply_little_endian: return "PLY (binary, little endian)";
    case MeshFormat::ply_big_endian: return "PLY (binary, big endian)";
    case MeshFormat::obj: return "OBJ";
  }
  return "";
}

std::string out_of_range(std::uint64_t triangle, double index, std::uint64_t vertices) {
  std::string text = "triangle " + std::to_string(triangle) + " has vertex ";
  append_number(text, index);
  return text + ", but there are " + std::to_string(vertices) + ", counted from 0";
}

Result<MeshFile> read_mesh(std::istream& in, const std::string& name) {
  MeshSource source(in, name);
  if (source.begins_with("ply")) return read_ply(source);
  for (const char* keyword : {"OFF", "COFF", "NOFF", "CNOFF"}) {
    if (source.begins_with(keyword)) return read_off(source);
  }
  const std::string ending = ending_of(name);
  if (ending == ".off") return read_off(source);
  if (ending == ".ply") return read_ply(source);
  if (ending == ".obj") return read_obj(source);
  return Problem{"mesh-format-unknown", name + " is neither a PLY nor an OFF, and is not called .obj", "PLY, OFF or OBJ",
                 "input"};
}

Result<MeshFile> read_mesh_file(const std::string& path) {
  std::error_code error;
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path, error)) {
    return Problem{"file-unreadable", "cannot read " + path, "a mesh: PLY, OFF or OBJ", "input"};
  }
  auto read = read_mesh(file, path);
  // A disk that fails looks like an end that comes too early.
  if (file.bad()) {
    return Problem{"file-unreadable", "reading " + path + " failed midway", "a file that can be read to its end", "input"};
  }
  return read;
}

Result<MeshEncoding> encoding_for(const std::string& path, const MeshEncoding& source) {
  const std::string ending = ending_of(path);
  if (ending == ".off") return MeshEncoding{MeshFormat::off, CoordinateType::float64};
  if (ending == ".obj") return MeshEncoding{MeshFormat::obj, CoordinateType::float64};
  if (ending == ".ply") {
    const bool was_ply = source.format != MeshFormat::off && source.format != MeshFormat::obj;
    return MeshEncoding{was_ply ? source.format : MeshFormat::ply_little_endian, source.coordinates};
  }
  return Problem{"mesh-format-unknown", "the name " + path + " does not say which format to write", kEndings, "--output"};
}

TriangleMesh as_written(TriangleMesh mesh, const MeshEncoding& encoding) {
  if (encoding.coordinates == CoordinateType::float64) return mesh;
  for (auto* axis : {&mesh.x, &mesh.y, &mesh.z}) {
    for (double& value : *axis) value = static_cast<float>(value);
  }
  return mesh;
}

bool write_mesh(std::ostream& out, const TriangleMesh& mesh, const MeshEncoding& encoding) {
  MeshText text(out);
  if (encoding.format == MeshFormat::off) {
    write_off(text, mesh);
  } else if (encoding.format == MeshFormat::obj) {
    write_obj(text, mesh, encoding);
  } else {
    write_ply(text, mesh, encoding);
  }
  text.write();
  return static_cast<bool>(out.flush());
}

Result<void> write_mesh_file(const std::string& path, const TriangleMesh& mesh, const MeshEncoding& encoding) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) return unwritable(path, "it is there and no file");
  const fs::path place = behind_link(path, error);
  const fs::path temporary = temporary_for(place);
  std::ofstream file(temporary, std::ios::binary | std::ios::trunc);
  if (!file) return unwritable(path, "its folder cannot be written");
  bool written = write_mesh(file, mesh, encoding);
  file.close();
  written = written && !file.fail();
  error.clear();  // that there is no earlier file was no failure
  if (written) fs::rename(temporary, place, error);
  if (written && !error) return {};
  const std::string why = error ? error.message() : "no room, or the disk failed";
  fs::remove(temporary, error);
  return unwritable(path, why);
}

}  // namespace cordillera::proto
