#pragma once
// What of GDAL and PROJ is installed: for whoever looks after the machine.
#include <string>
#include <vector>

namespace cordillera::raster {

struct DriverState {
  std::string name;   ///< as GDAL has it
  std::string reads;  ///< which files
  bool installed = false;
};

/// The drivers that this program opens files with, and no others.
std::vector<DriverState> drivers();
/// "GDAL 3.6.2, released …".
std::string gdal_version();
/// Whether PROJ finds its database: without it no CRS is known.
bool knows_crs();

}  // namespace cordillera::raster
