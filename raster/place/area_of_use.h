#pragma once
// Where on the earth a CRS is meant to be used: a raster far from there has the wrong CRS, mostly.
#include <ogr_spatialref.h>

#include <optional>
#include <string>

#include "raster/place/area.h"

namespace cordillera::raster {

struct AreaOfUse {
  Area stated;  ///< as PROJ's database has it
  Area usual;   ///< of a UTM zone with the zones beside it and the other hemisphere, where it is used as well
};
/// So far away nobody draws a map of a country or a continent.
inline constexpr double kAbsurd_deg = 30;
/// None: nobody states one.
std::optional<AreaOfUse> area_of_use(const OGRSpatialReference& srs);

struct LonLat {
  double longitude_deg = 0, latitude_deg = 0;
};
/// The place of the area that is nearest, about, with its longitude in [-180, 180]; inside the place itself.
LonLat nearest_place(const Area& area, double longitude_deg, double latitude_deg);
/// Degrees of arc to the place of the area that is nearest, about; 0 inside.
double degrees_away(const Area& area, double longitude_deg, double latitude_deg);

/// "69.05 W, 73.69 N".
std::string place_text(double longitude_deg, double latitude_deg);
/// "5.96 E to 10.49 E, 45.82 N to 47.81 N".
std::string area_text(const Area& area);

}  // namespace cordillera::raster
