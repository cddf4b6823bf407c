#include "raster/open/raster_state.h"

#include <gdal_priv.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"
#include "raster/storage/ranged_file.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> files_beside(const std::string& path) {
  std::vector<std::string> files = sides_of(path);
  files.push_back(path + ".msk");
  std::error_code error;
  std::erase_if(files, [&](const std::string& file) { return file == path || !fs::is_regular_file(file, error); });
  return files;
}

/// What GDAL finds in a VRT; no more than its name where it is none.
std::vector<std::string> files_in_vrt(const std::string& path) {
  const GdalScope scope(Trust::operator_file);
  const char* const drivers[] = {"VRT", nullptr};
  const std::unique_ptr<GDALDataset> vrt(
      GDALDataset::FromHandle(GDALOpenEx(path.c_str(), GDAL_OF_RASTER, drivers, nullptr, nullptr)));
  std::vector<std::string> files;
  if (vrt == nullptr) return files;
  const std::unique_ptr<char*, decltype(&CSLDestroy)> list(vrt->GetFileList(), CSLDestroy);
  for (char** file = list.get(); file != nullptr && *file != nullptr; ++file) files.emplace_back(*file);
  return files;
}

/// FNV-1a, 64 bits: http://www.isthe.com/chongo/tech/comp/fnv
std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325;
  for (const unsigned char c : text) hash = (hash ^ c) * 0x100000001b3;
  return std::to_string(hash);
}

/// With all of its parts: a VRT may name another.
void add_parts(const std::string& path, std::set<std::string>& parts) {
  if (!parts.insert(path).second || is_remote(path)) return;
  for (const std::string& file : files_beside(path)) parts.insert(file);
  if (extension_of(path) != ".vrt") return;
  for (const std::string& file : files_in_vrt(path)) add_parts(file, parts);
}

}  // namespace

std::string state_of_raster(const std::string& path, Trust trust) {
  std::string own = state_of(path);
  if (trust != Trust::operator_file || own.empty() || is_remote(path) || ranged_file(path) || is_vrt_of_ranged_files(path))
    return own;
  std::set<std::string> parts;
  add_parts(path, parts);
  if (parts.size() == 1) return own;
  // By names that are the same wherever the command is given.
  std::error_code error;
  const auto whole = [&](const std::string& name) { return fs::absolute(name, error).lexically_normal(); };
  const fs::path folder = whole(path).parent_path();
  std::map<std::string, std::string> states;  // by those names
  for (const std::string& part : parts) states[whole(part).lexically_relative(folder).string()] = state_of(part);
  std::string all;
  for (const auto& [name, state] : states) all += name + "\n" + state + "\n";
  return own + ", and " + std::to_string(states.size() - 1) + (states.size() == 2 ? " file" : " files") +
         " with it: " + hash_of(all);
}

}  // namespace cordillera::raster
