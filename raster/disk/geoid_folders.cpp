#include "raster/disk/geoid_folders.h"

#include <GeographicLib/Geoid.hpp>

#include <cstdlib>

#include "proto/parts.h"

namespace cordillera::raster {

std::vector<std::filesystem::path> geoid_folders() {
  std::vector<std::filesystem::path> folders;
  const char* named = std::getenv("CORDILLERA_GEOIDS");
  proto::each_part(named == nullptr ? "" : named, ':', [&](std::string_view folder) {
    if (!folder.empty()) folders.emplace_back(folder);
  });
  folders.emplace_back(GeographicLib::Geoid::DefaultGeoidPath());
  folders.emplace_back("/usr/share/proj");
  return folders;
}

std::string find_in_geoid_folders(const std::string& file) {
  std::error_code error;
  for (const std::filesystem::path& folder : geoid_folders())
    if (std::filesystem::is_regular_file(folder / file, error)) return (folder / file).string();
  return "";
}

std::string geoid_home(Trust trust) {
  const std::string named = "a folder named by CORDILLERA_GEOIDS";
  return trust == Trust::posted_file ? named : geoid_folders().front().string() + " or " + named;
}

}  // namespace cordillera::raster
