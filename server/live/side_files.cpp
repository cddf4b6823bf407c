#include "server/live/side_files.h"

#include <algorithm>
#include <filesystem>

#include "proto/letters.h"
#include "raster/gdal/formats.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

std::string name_of(const std::string& path) { return fs::path(path).filename().string(); }
/// Folder and name in one; letters of folders count.
std::string key(const std::string& path, const std::string& name) {
  return (fs::path(path).parent_path() / proto::lower(name)).string();
}
std::string stem_of(const std::string& name) { return fs::path(name).stem().string(); }

bool is_tiff(const std::string& name) {
  const std::string extension = raster::extension_of(name);
  return extension == ".tif" || extension == ".tiff";
}

}  // namespace

void FilePrint::add(const FilePrint& side) {
  constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15;  // so that no two times cancel out
  changed_ns =
      static_cast<std::int64_t>(static_cast<std::uint64_t>(changed_ns) + kOdd * static_cast<std::uint64_t>(side.changed_ns));
  bytes += side.bytes;
}

void SideFiles::add(const std::string& path, const FilePrint& print) {
  const std::string name = name_of(path);
  by_stem_[key(path, raster::is_pam(name) ? stem_of(stem_of(name)) : stem_of(name))].push_back({path, print});
}

std::vector<SideFiles::Side> SideFiles::of(const std::string& raster) const {
  std::vector<Side> sides;
  const std::string name = name_of(raster);
  for (const std::string& beside : {stem_of(name), name}) {
    const auto found = by_stem_.find(key(raster, beside));
    if (found == by_stem_.end()) continue;
    for (const Side& side : found->second) {
      const std::string other = name_of(side.path);
      if (raster::is_side_of(name, other) && !(raster::is_pam(other) && is_tiff(name))) sides.push_back(side);
    }
  }
  std::ranges::sort(sides, {}, &Side::path);
  return sides;
}

}  // namespace cordillera::server
