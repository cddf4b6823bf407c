#include "raster/place/area.h"

#include <algorithm>
#include <cstdio>

namespace cordillera::raster {

std::optional<Area> intersect(const Area& area, const Area& clip) {
  bool found = false;
  Area both{0, std::max(area.south_deg, clip.south_deg), 0, std::min(area.north_deg, clip.north_deg)};
  if (both.south_deg > both.north_deg) return std::nullopt;
  // Two arcs of a circle may meet in two pieces: then the smallest interval of area that holds both.
  for (int turn = -2; turn <= 2; ++turn) {
    const double west = std::max(area.west_deg, clip.west_deg + 360 * turn),
                 east = std::min(area.east_deg, clip.east_deg + 360 * turn);
    if (west > east) continue;
    both.west_deg = found ? std::min(both.west_deg, west) : west;
    both.east_deg = found ? std::max(both.east_deg, east) : east;
    found = true;
  }
  if (!found) return std::nullopt;
  return both;
}

std::string text_of(const Area& area) {
  char text[128];
  std::snprintf(text, sizeof text, "%.6g,%.6g,%.6g,%.6g", area.west_deg, area.south_deg,
                area.east_deg > 180 ? area.east_deg - 360 : area.east_deg, area.north_deg);
  return text;
}

std::string hint_on_order(const Area& box, const Area& data) {
  const Area turned = {box.south_deg, box.west_deg, box.north_deg, box.east_deg};
  const bool meant =
      turned.south_deg >= -90 && turned.north_deg <= 90 && turned.south_deg < turned.north_deg && intersect(data, turned);
  return meant ? "; in the order west,south,east,north it would: " + text_of(turned) : "";
}

}  // namespace cordillera::raster
