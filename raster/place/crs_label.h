#pragma once
// What people read where a CRS is meant.
#include <ogr_spatialref.h>

#include <string>

namespace cordillera::raster {

/// "WGS 84 / UTM zone 11N (EPSG:32611)". A CRS without a name is told by its projection, the name of what that is based on, and
/// its parameters as PROJ writes them: "Transverse Mercator on WGS 84 (+proj=tmerc +lat_0=0 +lon_0=9 …)".
std::string crs_label(const OGRSpatialReference& srs);
/// What GDAL says, which has no text where there is none.
inline std::string text_of(const char* text) { return text == nullptr ? "" : text; }

}  // namespace cordillera::raster
