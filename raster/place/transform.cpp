#include "raster/place/transform.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace cordillera::raster {

OGRSpatialReference wgs84() {
  OGRSpatialReference srs;
  srs.importFromEPSG(4326);
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return srs;
}

std::unique_ptr<OGRCoordinateTransformation> best_around(double longitude_deg, double latitude_deg, const OGRSpatialReference& to,
                                                         OGRCoordinateTransformationOptions options) {
  const double south = std::max(-90.0, latitude_deg - 0.5), north = std::min(90.0, latitude_deg + 0.5);
  const double west = std::max(-180.0, longitude_deg - 0.5), east = std::min(180.0, longitude_deg + 0.5);
  if (west < east && south < north) options.SetAreaOfInterest(west, south, east, north);
  const OGRSpatialReference geographic = wgs84();
  return std::unique_ptr<OGRCoordinateTransformation>(OGRCreateCoordinateTransformation(&geographic, &to, options));
}

void apply(OGRCoordinateTransformation& transform, double* x, double* y, std::size_t count) {
  // Blocks keep the flags on the stack; each point is transformed on its own whatever block it is in.
  constexpr std::size_t kBlock = 1024;
  int ok[kBlock];
  for (std::size_t at = 0; at < count; at += kBlock) {
    const int n = static_cast<int>(std::min(kBlock, count - at));
    transform.Transform(n, x + at, y + at, nullptr, ok);
    for (int k = 0; k < n; ++k)
      if (!ok[k] || !std::isfinite(x[at + k]) || !std::isfinite(y[at + k]))
        x[at + k] = y[at + k] = std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace cordillera::raster
