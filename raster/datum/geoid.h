#pragma once
// Height of the geoid above the WGS 84 ellipsoid.
#include <memory>
#include <span>
#include <string>

#include "proto/result.h"
#include "raster/place/area.h"

namespace cordillera::raster {

class Geoid {
 public:
  virtual ~Geoid() = default;
  /// To be added to a height above the geoid. Not thread-safe.
  virtual double undulation_m(double latitude_deg, double longitude_deg) const = 0;
  /// The same at points of one parallel, from west to east, over the antimeridian too, less than kAlongParallel_m off: a grid's
  /// cell costs once what else every point does. out as long as longitude_deg.
  virtual void along_parallel(double latitude_deg, std::span<const double> longitude_deg, double* out) const {
    for (const double longitude : longitude_deg) *out++ = undulation_m(latitude_deg, longitude);
  }
};
inline constexpr double kAlongParallel_m = 1e-9;

/// A global grid in GeographicLib's PGM format, interpolated with its cubic fit (rms error 7 mm on the 15' grid; bilinear: 40
/// mm).
proto::Result<std::unique_ptr<Geoid>> open_geoid_pgm(const std::string& path, const Area& area);

/// A grid that GDAL reads (GTX or GeoTIFF in degrees), interpolated bilinearly; it must cover the area.
proto::Result<std::unique_ptr<Geoid>> open_geoid_grid(const std::string& path, const Area& area);

/// The problem of a grid that ends before the data does.
proto::Problem geoid_does_not_cover(const std::string& name, const Area& area);

/// Path of egm96-15.pgm: share/cordillera or share beside the program's own folder, where the installation or the build has put
/// it. Empty: it is not there. No process makes it.
std::string egm96_path();

}  // namespace cordillera::raster
