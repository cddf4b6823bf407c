#include "raster/place/transform.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "proto/lru.h"
#include "raster/place/crs.h"

namespace cordillera::raster {

OGRSpatialReference wgs84() {
  OGRSpatialReference srs;
  srs.importFromEPSG(4326);
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  return srs;
}

namespace {

using Transformation = std::unique_ptr<OGRCoordinateTransformation>;

/// What PROJ found, never used: one that was used remembers where. key: empty, it is not to be kept.
Transformation copy_of(const OGRSpatialReference& from, const OGRSpatialReference& to,
                       const OGRCoordinateTransformationOptions& options, const std::string& key) {
  constexpr std::size_t kMostKept = 256;
  // Never freed: at the end of the program PROJ may have gone before it.
  static auto& found = *new proto::Lru<std::string, std::shared_ptr<const OGRCoordinateTransformation>>(kMostKept);
  if (key.empty()) return Transformation(OGRCreateCoordinateTransformation(&from, &to, options));
  if (const auto kept = found.find(key)) return Transformation((*kept)->Clone());
  std::shared_ptr<const OGRCoordinateTransformation> fresh(OGRCreateCoordinateTransformation(&from, &to, options));
  if (!fresh) return nullptr;
  found.keep(key, fresh, 1);
  return Transformation(fresh->Clone());
}

/// Of a system that cannot be written nothing is kept.
std::string key_of(const std::string& way, const OGRSpatialReference& srs) {
  const std::string wkt = wkt_of(srs);
  return wkt.empty() ? "" : way + wkt;
}

OGRCoordinateTransformationOptions options_of(Ballpark ballpark) {
  OGRCoordinateTransformationOptions options;
  options.SetBallparkAllowed(ballpark == Ballpark::allowed);
  return options;
}

}  // namespace

Transformation to_wgs84(const OGRSpatialReference& from, Ballpark ballpark) {
  return copy_of(from, wgs84(), options_of(ballpark), key_of("from" + std::to_string(static_cast<int>(ballpark)), from));
}

Transformation best_around(double longitude_deg, double latitude_deg, const OGRSpatialReference& to, Ballpark ballpark) {
  constexpr double kStep_deg = 0.25;
  const double longitude = kStep_deg * std::round(longitude_deg / kStep_deg),
               latitude = kStep_deg * std::round(latitude_deg / kStep_deg);
  const double south = std::max(-90.0, latitude - 0.5), north = std::min(90.0, latitude + 0.5);
  const double west = std::max(-180.0, longitude - 0.5), east = std::min(180.0, longitude + 0.5);
  OGRCoordinateTransformationOptions options = options_of(ballpark);
  std::string way = "to" + std::to_string(static_cast<int>(ballpark));
  if (west < east && south < north) {
    options.SetAreaOfInterest(west, south, east, north);
    way += " " + std::to_string(longitude) + " " + std::to_string(latitude) + " ";
  }
  return copy_of(wgs84(), to, options, key_of(way, to));
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
