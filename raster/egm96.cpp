// Where the EGM96 grid lies. The build makes it (make_egm96.cpp); nothing that runs later writes it.
#include <filesystem>

#include "raster/geoid.h"

namespace cordillera::raster {

std::string egm96_path() {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path share = fs::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "share";
  for (const fs::path& path : {share / "cordillera" / "egm96-15.pgm", share / "egm96-15.pgm"})
    if (fs::is_regular_file(path, error)) return path.string();
  return "";
}

}  // namespace cordillera::raster
