#include "raster/gdal/drivers.h"

#include <gdal.h>
#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include "raster/gdal/formats.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {

std::vector<DriverState> drivers() {
  const GdalScope scope(Trust::operator_file);
  GDALAllRegister();
  std::vector<DriverState> states;
  for (const Format& format : formats()) states.push_back({format.driver, format.reads});
  for (DriverState& state : states) state.installed = GetGDALDriverManager()->GetDriverByName(state.name.c_str()) != nullptr;
  return states;
}

std::string gdal_version() { return GDALVersionInfo("--version"); }

bool knows_crs() {
  const GdalScope scope(Trust::operator_file);
  OGRSpatialReference crs;
  return crs.importFromEPSG(32632) == OGRERR_NONE;
}

}  // namespace cordillera::raster
