// Where the EGM96 grid lies. The build makes it (make_egm96.cpp); nothing that runs later writes it.
#include "raster/datum/geoid.h"
#include "raster/disk/share_folder.h"

namespace cordillera::raster {

std::string egm96_path() {
  std::error_code error;
  for (const char* name : {"cordillera/egm96-15.pgm", "egm96-15.pgm"}) {
    const std::filesystem::path path = share_folder() / name;
    if (std::filesystem::is_regular_file(path, error)) return path.string();
  }
  return "";
}

}  // namespace cordillera::raster
