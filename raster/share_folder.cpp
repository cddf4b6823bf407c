#include "raster/share_folder.h"

#include <cstdlib>
#include <string>

namespace cordillera::raster {

namespace fs = std::filesystem;

fs::path share_folder() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "share";
}

void use_private_tables() {
  std::error_code error;
  const std::string own = share_folder() / "cordillera" / "proj";
  if (!fs::is_regular_file(own + "/proj.db", error)) return;
  const char* given = std::getenv("PROJ_DATA");
  const std::string others = given == nullptr ? "" : given;
  if (others != own && !others.starts_with(own + ":")) setenv("PROJ_DATA", (others.empty() ? own : own + ":" + others).c_str(), 1);
  setenv("GDAL_DRIVER_PATH", "disable", 1);  // plugins of the machine's GDAL are not for this one
}

}  // namespace cordillera::raster
