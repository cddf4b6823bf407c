#include "raster/place/area.h"

#include <algorithm>

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

}  // namespace cordillera::raster
