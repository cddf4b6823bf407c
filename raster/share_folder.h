#pragma once
#include <filesystem>

namespace cordillera::raster {

/// share/ beside the folder of the program: what the build, an installation or an unpacked archive keeps for it. May not exist.
std::filesystem::path share_folder();

/// An archive that brings its own libraries has PROJ's tables in share/cordillera/proj. If they are there, this process and those it starts
/// use them, before those that PROJ_DATA names: another PROJ's database would be refused. To be called before the first thread.
void use_private_tables();

}  // namespace cordillera::raster
