#include "raster/place/area_of_use.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "proto/degrees.h"
#include "raster/place/crs_label.h"

namespace cordillera::raster {
namespace {

constexpr double kZone_deg = 6;

std::optional<Area> stated(const OGRSpatialReference& srs) {
  Area area;
  const char* name = nullptr;
  if (!srs.GetAreaOfUse(&area.west_deg, &area.south_deg, &area.east_deg, &area.north_deg, &name)) return std::nullopt;
  if (area.west_deg < -360) return std::nullopt;  // GDAL's word for unknown
  if (area.east_deg < area.west_deg) area.east_deg += 360;
  return area;
}

std::string degrees_text(double degrees, const char* letters) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f %c", std::abs(degrees), letters[degrees < 0 ? 1 : 0]);
  return text;
}

std::string longitude_text(double degrees) { return degrees_text(std::remainder(degrees, 360.0), "EW"); }

}  // namespace

std::optional<AreaOfUse> area_of_use(const OGRSpatialReference& srs) {
  auto area = stated(srs);
  const std::string authority = text_of(srs.GetAuthorityName(nullptr)), code = text_of(srs.GetAuthorityCode(nullptr));
  if (!area && !authority.empty() && !code.empty()) {  // lost with a vertical part, or in WKT 1
    OGRSpatialReference again;
    if (again.SetFromUserInput((authority + ":" + code).c_str()) == OGRERR_NONE) area = stated(again);
  }
  if (!area) return std::nullopt;
  AreaOfUse use{*area, *area};
  if (srs.GetUTMZone(nullptr) == 0) return use;
  use.usual = {area->west_deg - kZone_deg, std::min(area->south_deg, -area->north_deg), area->east_deg + kZone_deg,
               std::max(area->north_deg, -area->south_deg)};
  return use;
}

LonLat nearest_place(const Area& area, double longitude_deg, double latitude_deg) {
  const double middle_deg = (area.west_deg + area.east_deg) / 2, half_deg = (area.east_deg - area.west_deg) / 2;
  const double aside_deg = std::clamp(std::remainder(longitude_deg - middle_deg, 360.0), -half_deg, half_deg);
  return {std::remainder(middle_deg + aside_deg, 360.0), std::clamp(latitude_deg, area.south_deg, area.north_deg)};
}

double degrees_away(const Area& area, double longitude_deg, double latitude_deg) {
  const LonLat near = nearest_place(area, longitude_deg, latitude_deg);
  const double from = latitude_deg / proto::kRadian_deg, to = near.latitude_deg / proto::kRadian_deg;
  const double up = std::sin((to - from) / 2), across = std::sin((longitude_deg - near.longitude_deg) / 2 / proto::kRadian_deg);
  return 2 * std::asin(std::sqrt(std::min(1.0, up * up + std::cos(from) * std::cos(to) * across * across))) * proto::kRadian_deg;
}

std::string place_text(double longitude_deg, double latitude_deg) {
  return longitude_text(longitude_deg) + ", " + degrees_text(latitude_deg, "NS");
}

std::string area_text(const Area& area) {
  return longitude_text(area.west_deg) + " to " + longitude_text(area.east_deg) + ", " + degrees_text(area.south_deg, "NS") +
         " to " + degrees_text(area.north_deg, "NS");
}

}  // namespace cordillera::raster
