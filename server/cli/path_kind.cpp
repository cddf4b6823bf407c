#include "server/cli/path_kind.h"

#include <filesystem>
#include <fstream>

namespace cordillera::server {

PathKind path_kind(const std::string& path) {
  static const std::string kSqlite("SQLite format 3\0", 16), kGeoPackage = "GPKG";
  constexpr std::size_t kApplicationId = 68;  // in the header of an SQLite file
  std::error_code error;
  if (!std::filesystem::exists(path, error)) return PathKind::missing;
  if (std::filesystem::is_directory(path, error)) return PathKind::folder;
  std::string begin(kApplicationId + kGeoPackage.size(), ' ');
  std::ifstream file(path, std::ios::binary);
  const bool sqlite = file.read(begin.data(), static_cast<std::streamsize>(begin.size())) && begin.starts_with(kSqlite);
  return sqlite && !begin.ends_with(kGeoPackage) ? PathKind::store : PathKind::raster;
}

proto::Problem at_work_there(const std::string& place) {
  return {"store-write", "another process is writing " + place, "to wait until it has ended, or another place", "--output"};
}

}  // namespace cordillera::server
