// What rasters are read with.
#include "raster/datum/vertical.h"
#include "raster/gdal/drivers.h"
#include "server/doctor/doctor.h"

namespace cordillera::server::doctor {
namespace {

Finding formats() {
  std::string there, missing;
  for (const raster::DriverState& driver : raster::drivers()) {
    std::string& list = driver.installed ? there : missing;
    list += (list.empty() ? "" : ", ") + driver.name + " (" + driver.reads + ")";
  }
  const std::string version = raster::gdal_version();
  if (missing.empty()) return Finding{"GDAL", Health::good, version + ": " + there, ""};
  const bool main_one = missing.find("GTiff") == missing.npos;
  return Finding{"GDAL", main_one ? Health::warning : Health::bad, version + "; missing: " + missing,
                 "GDAL with these drivers, such as Debian's libgdal"};
}

Finding crs() {
  if (raster::knows_crs()) return Finding{"PROJ", Health::good, "finds its database", ""};
  return Finding{"PROJ", Health::bad, "does not find its database: no coordinate system is known",
                 "proj-data, and no PROJ_DATA or PROJ_LIB that points elsewhere"};
}

/// A geoid is there if heights can be asked of it.
Finding geoid(const std::string& datum, Health without) {
  const auto found = raster::resolve_vertical({.requested = datum}, raster::Trust::operator_file, {-10, -10, 10, 10});
  if (found) return {datum, Health::good, "its grid is there", ""};
  return {datum, without, found.problem().detail, found.problem().accepted};
}

}  // namespace

void check_libraries(const Settings&, Findings& findings) {
  findings.push_back(formats());
  findings.push_back(crs());
  findings.push_back(geoid("EGM96", Health::bad));
  findings.push_back(geoid("EGM2008", Health::warning));
}

}  // namespace cordillera::server::doctor
