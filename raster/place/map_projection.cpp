#include "raster/place/map_projection.h"

#include <ogr_spatialref.h>

#include <cmath>

#include "raster/gdal/gdal_scope.h"
#include "raster/place/area_of_use.h"
#include "raster/place/crs.h"
#include "raster/place/crs_label.h"
#include "raster/place/transform.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr const char* kAccepted = "the code of a projected CRS that holds the data, such as EPSG:";

/// Of a projection that holds a place whatever the country: its UTM zone, and around the poles a polar stereographic one.
std::string code_around(double longitude_deg, double latitude_deg) {
  if (latitude_deg > 84) return "3413";
  if (latitude_deg < -80) return "3031";
  const int zone = static_cast<int>(std::floor((longitude_deg + 180) / 6)) % 60 + 1;
  return std::to_string((latitude_deg < 0 ? 32700 : 32600) + zone);
}

}  // namespace

MapProjection::MapProjection() = default;
MapProjection::MapProjection(MapProjection&&) noexcept = default;
MapProjection::~MapProjection() = default;

proto::Result<MapProjection> MapProjection::open(const std::string& code, double longitude_deg, double latitude_deg) {
  const GdalScope scope(Trust::posted_file);
  const std::string accepted = kAccepted + code_around(longitude_deg, latitude_deg);
  OGRSpatialReference srs;
  if (srs.SetFromUserInput(code.c_str(), kSealedCrs) != OGRERR_NONE)
    return Problem{"crs-unknown", code + " is no coordinate reference system that PROJ knows", accepted, "frame"};
  MapProjection map;
  map.code_ = code;
  map.label_ = crs_label(srs);
  if (srs.IsCompound()) srs.StripVertical();
  if (!srs.IsProjected())
    return Problem{"crs-unsupported", map.label_ + (srs.IsGeographic() ? " is in degrees" : " is no projected CRS"),
                   accepted + (srs.IsGeographic() ? ", or geodetic" : ""), "frame"};
  if (const auto use = area_of_use(srs); use && degrees_away(use->usual, longitude_deg, latitude_deg) > kAbsurd_deg)
    return Problem{"crs-unsupported",
                   map.label_ + " is meant for " + area_text(use->stated) + "; the data lies around " +
                       place_text(longitude_deg, latitude_deg),
                   accepted, "frame"};
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const char* unit = nullptr;
  map.unit_m_ = srs.GetLinearUnits(&unit);
  map.unit_ = text_of(unit);
  for (const Ballpark ballpark : {Ballpark::refused, Ballpark::allowed}) {
    map.from_degrees_ = best_around(longitude_deg, latitude_deg, srs, ballpark);
    if (!map.from_degrees_) continue;
    double x = longitude_deg, y = latitude_deg;
    apply(*map.from_degrees_, &x, &y, 1);
    if (std::isfinite(x)) return map;
  }
  return Problem{"crs-unsupported", map.label_ + " has no coordinates for the middle of the data", accepted, "frame"};
}

void MapProjection::project(double* x, double* y, std::size_t count) const {
  const GdalScope scope(Trust::posted_file);
  apply(*from_degrees_, x, y, count);
}

std::string code_in_label(const std::string& label) {
  const auto open = label.rfind('(');
  if (open == label.npos || label.back() != ')') return "";
  std::string code = label.substr(open + 1, label.size() - open - 2);
  const auto colon = code.find(':');
  const bool numbered = colon != code.npos && colon > 0 && colon + 1 < code.size() &&
                        code.find_first_not_of("0123456789", colon + 1) == code.npos && code.find(' ') == code.npos;
  return numbered ? code : "";
}

}  // namespace cordillera::raster
