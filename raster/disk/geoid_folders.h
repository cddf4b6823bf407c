#pragma once
// Where geoid grids are looked for.
#include <filesystem>
#include <string>
#include <vector>

#include "raster/source.h"

namespace cordillera::raster {

/// The folders an operator allows: $CORDILLERA_GEOIDS (separated by ':'), then GeographicLib's own and PROJ's.
std::vector<std::filesystem::path> geoid_folders();

/// The path of a grid of that name in the first of them that has it; empty: none has.
std::string find_in_geoid_folders(const std::string& file);

/// Where a grid that is missing can be put. Who posted a file is told of no folder of the operator's.
std::string geoid_home(Trust trust);

}  // namespace cordillera::raster
