// cordillera decode: a tile file read back with Draco's own decoder, so that anyone can check what curl brought.
#include <filesystem>
#include <iostream>

#include "pipeline/encode/decode.h"
#include "proto/files.h"
#include "server/cli/commands.h"

namespace cordillera::server {
namespace {

proto::Result<std::string> read_file(const std::string& path) {
  std::error_code error;
  auto bytes = std::filesystem::is_regular_file(path, error) ? proto::bytes_of_file(path) : std::nullopt;
  if (!bytes) return proto::Problem{"file-unreadable", "it cannot be read", "", "path"};
  return std::move(*bytes);
}

int refuse(proto::Problem problem, const std::string& path) {
  problem.detail = path + ": " + problem.detail;
  problem.accepted = "a .drc or .glb tile that Cordillera wrote";
  return fail(problem);
}

int print_drc(const std::string& path, const std::string& bytes) {
  const auto tile = pipeline::decode_drc(bytes);
  if (!tile) return refuse(tile.problem(), path);
  std::cout << path << ": tile " << tile->z << '/' << tile->x << '/' << tile->y << ", " << tile->points.size() << " vertices, "
            << tile->triangles.size() << " triangles\n";
  return kDone;
}

int print_glb(const std::string& path, const std::string& bytes) {
  const auto tile = pipeline::decode_glb(bytes);
  if (!tile) return refuse(tile.problem(), path);
  std::cout << path << ": " << tile->points.size() << " vertices, " << tile->triangles.size() << " triangles, "
            << tile->skirt_triangles.size() << " skirt triangles\n";
  return kDone;
}

}  // namespace

int decode_command(const std::string& path) {
  std::error_code error;
  if (std::filesystem::symlink_status(path, error).type() == std::filesystem::file_type::not_found)
    return fail({"file-unreadable", "there is no " + path, "a .drc or .glb tile that Cordillera wrote", "path"});
  const auto bytes = read_file(path);
  if (!bytes) return refuse(bytes.problem(), path);
  if (bytes->starts_with("glTF")) return print_glb(path, *bytes);
  if (bytes->starts_with("DRACO")) return print_drc(path, *bytes);
  return refuse({"tile-damaged", "it is neither a .drc nor a .glb tile", "", "path"}, path);
}

}  // namespace cordillera::server
