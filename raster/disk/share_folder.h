#pragma once
#include <filesystem>

namespace cordillera::raster {

/// share/ beside the folder of the program: what the build, an installation or an unpacked archive keeps for it. May not exist.
std::filesystem::path share_folder();

/// An archive that brings its own libraries has PROJ's tables in share/cordillera/proj. If they are there, this process and those
/// it starts use them, before those that PROJ_DATA names: another PROJ's database would be refused. And the libraries, which know
/// only Debian's places, are told where this machine keeps its certificates. To be called before the first thread.
void fit_private_libraries();

}  // namespace cordillera::raster
