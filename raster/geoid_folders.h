#pragma once
// Where geoid grids are looked for.
#include <filesystem>
#include <vector>

namespace cordillera::raster {

/// The folders an operator allows: $CORDILLERA_GEOIDS (separated by ':'), then GeographicLib's own and PROJ's.
std::vector<std::filesystem::path> geoid_folders();

}  // namespace cordillera::raster
