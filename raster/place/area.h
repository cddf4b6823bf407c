#pragma once
// A part of the earth.

namespace cordillera::raster {

/// A rectangle in degrees; west <= east, and east may exceed 180.
struct Area {
  double west_deg = 0, south_deg = 0, east_deg = 0, north_deg = 0;
};

}  // namespace cordillera::raster
