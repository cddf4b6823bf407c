#include "raster/disk/private_folder.h"

#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "proto/letters.h"

namespace cordillera::raster {

namespace fs = std::filesystem;

PrivateFolder::PrivateFolder() {
  std::error_code error;
  std::string folder = (fs::temp_directory_path(error) / "cordillera-XXXXXX").string();
  if (!error && mkdtemp(folder.data()) != nullptr) path_ = folder;
}

PrivateFolder::~PrivateFolder() {
  std::error_code ignored;
  if (made()) fs::remove_all(path_, ignored);
}

std::string PrivateFolder::place(const std::string& name) const {
  std::string safe = name;
  for (char& c : safe)
    if (!proto::is_letter_or_digit(c, ".-_")) c = '_';
  if (safe.empty() || safe[0] == '.') safe.insert(0, "raster");
  if (safe.size() > 200) safe = safe.substr(safe.size() - 200);
  return (fs::path(path_) / safe).string();
}

std::string PrivateFolder::link(const std::string& target, const std::string& name) const {
  std::error_code error;
  const std::string path = place(name);
  if (made()) fs::create_symlink(fs::absolute(target, error), path, error);
  return made() && !error ? path : "";
}

}  // namespace cordillera::raster
