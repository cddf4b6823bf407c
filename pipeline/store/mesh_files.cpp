#include "pipeline/store/mesh_files.h"

#include <cerrno>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <vector>

#include "pipeline/store/sqlite.h"
#include "pipeline/threads/workers.h"
#include "raster/disk/new_file.h"
#include "raster/disk/write_all.h"

namespace cordillera::pipeline {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path) { throw StoreError(path + ": " + std::strerror(errno)); }

/// A name is on the disk only with its folder.
void sync_folder(const std::string& path) {
  if (!raster::sync_path(path)) fail(path);
}

}  // namespace

std::string MeshFiles::path_of(const proto::TileAddress& node) const {
  return folder_ + "/" + std::to_string(node.z) + "-" + std::to_string(node.x) + "-" + std::to_string(node.y);
}

void MeshFiles::put(const proto::TileAddress& node, const std::string& bytes) {
  std::error_code error;
  if (fs::create_directory(folder_, error)) sync_folder(fs::absolute(folder_).parent_path().string());
  const std::string path = path_of(node), part = path + ".part";
  fs::remove(part, error);
  raster::NewFile file(part);
  if (!file.is_open() || !file.write(bytes) || !file.close() || !raster::put_in_place(part, path)) fail(part);
}

bool MeshFiles::has(const proto::TileAddress& node) const {
  std::error_code error;
  return fs::exists(path_of(node), error);
}

std::optional<std::string> MeshFiles::get(const proto::TileAddress& node) const {
  std::ifstream file(path_of(node), std::ios::binary | std::ios::ate);
  if (!file) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(file.tellg()), '\0');
  file.seekg(0).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file) throw StoreError(path_of(node) + " cannot be read");
  return bytes;
}

void MeshFiles::drop(const proto::TileAddress& node) noexcept {
  std::error_code ignored;
  fs::remove(path_of(node), ignored);
}

/// Several threads: what takes time is to give back the memory in which the system has megabytes of each file.
void MeshFiles::drop_all() noexcept {
  constexpr unsigned kThreads = 8, kFewFiles = 8;
  std::error_code ignored;
  try {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_, ignored)) files.push_back(entry.path());
    const auto drop_one = [&files](std::size_t k, unsigned) {
      std::error_code error;
      fs::remove(files[k], error);
    };
    if (files.size() > kFewFiles) Workers(kThreads).each(files.size(), drop_one);
  } catch (const std::exception&) {}  // no memory or no thread: what is left goes here
  fs::remove_all(folder_, ignored);
}

void remove_store(const std::string& path) {
  remove_database(path);
  MeshFiles(path).drop_all();
}

}  // namespace cordillera::pipeline
