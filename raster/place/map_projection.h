#pragma once
// From longitude and latitude to the coordinates of a map.
#include <cstddef>
#include <memory>
#include <string>

#include "proto/result.h"

class OGRCoordinateTransformation;

namespace cordillera::raster {

/// Not thread-safe.
class MapProjection {
 public:
  /// code: of a projected CRS in PROJ's tables, such as EPSG:32632. The place is where PROJ's best operation is looked for.
  /// Problems: "crs-unknown", "crs-unsupported" (it is no projected one, or has no such place).
  static proto::Result<MapProjection> open(const std::string& code, double longitude_deg, double latitude_deg);
  MapProjection(MapProjection&&) noexcept;
  ~MapProjection();

  /// In place: longitude (WGS 84, any turn) -> to the east, latitude -> to the north, in units of the map; NaN where the map has
  /// no such place.
  void project(double* x, double* y, std::size_t count) const;

  const std::string& code() const { return code_; }
  const std::string& label() const { return label_; }  ///< "WGS 84 / UTM zone 32N (EPSG:32632)"
  const std::string& unit() const { return unit_; }    ///< "metre", "US survey foot"
  double unit_m() const { return unit_m_; }

 private:
  MapProjection();
  std::string code_, label_, unit_;
  double unit_m_ = 1;
  std::unique_ptr<OGRCoordinateTransformation> from_degrees_;
};

/// The code in what Source.crs says, "EPSG:32632"; empty where it has none.
std::string code_in_label(const std::string& label);

}  // namespace cordillera::raster
