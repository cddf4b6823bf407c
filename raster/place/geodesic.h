#pragma once
// Places along a line on the WGS 84 ellipsoid.
#include <cstddef>
#include <span>
#include <vector>

namespace cordillera::raster {

struct LinePoint {
  double longitude_deg = 0, latitude_deg = 0;
  double distance_m = 0;  ///< along the line from its first point
};

/// Places at equal distances along the shortest geodesics between the line's points, first and last included; longitudes in
/// [-180, 180]. The line's distances are not read. samples 0: the line's own points, with their distances; otherwise at least 2.
/// The line has a point.
std::vector<LinePoint> along_geodesics(std::span<const LinePoint> line, std::size_t samples);

}  // namespace cordillera::raster
