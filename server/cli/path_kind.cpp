#include "server/cli/path_kind.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

#include "raster/gdal/formats.h"
#include "raster/mosaic/source_list.h"

namespace cordillera::server {
namespace {

/// What no folder is called by intention.
constexpr std::string_view kFileEndings[] = {
    ".zip",  ".gz",  ".tgz", ".tar", ".7z",  ".png", ".jpg", ".jpeg", ".webp", ".html", ".htm",     ".json", ".geojson",
    ".gltf", ".las", ".laz", ".db",  ".csv", ".kml", ".kmz", ".shp",  ".pdf",  ".b3dm", ".terrain", ".drc",  ".sqlite3"};

}  // namespace

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

std::optional<proto::Problem> refuse_closed(const std::string& path, const std::string& parameter) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(path, error);
  if (error != std::errc::permission_denied && !(folder && ::access(path.c_str(), R_OK | X_OK) != 0)) return std::nullopt;
  return proto::Problem{"file-unreadable", path + " may not be read: Permission denied",
                        "a path that is open to whoever runs this", parameter};
}

bool holds_rasters(const std::string& path) {
  std::error_code error;
  const bool built = std::filesystem::exists(std::filesystem::path(path) / "manifest.json", error) ||
                     std::filesystem::exists(std::filesystem::path(path) / "dataset.sqlite", error);
  if (path_kind(path) != PathKind::folder || built) return false;
  const auto listed = raster::list_sources(path);
  return listed.ok() || listed.problem().type == "file-unreadable";  // who reads them says which
}

bool means_another_file(const std::string& output) {
  if (output == "-") return true;  // what other programs write to
  const std::string extension = raster::extension_of(output);
  const bool is_ending = std::find(std::begin(kFileEndings), std::end(kFileEndings), extension) != std::end(kFileEndings);
  return !std::filesystem::is_directory(output) && (is_ending || raster::is_raster_extension(extension));
}

proto::Problem no_such_file(const std::string& command, const std::string& output) {
  return {"usage", command + " writes no such file as " + output,
          "-o FOLDER (" + output + "/ is one), -o FILE.sqlite, or a name that export writes, such as -o FILE.pmtiles",
          "--output"};
}

proto::Problem at_work_there(const std::string& place) {
  return {"store-write", "another process is writing " + place, "to wait until it has ended, or another place", "--output"};
}

}  // namespace cordillera::server
