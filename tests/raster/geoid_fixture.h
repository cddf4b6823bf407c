#pragma once
// Rasters and a geoid grid of their place.
#include <string>

#include "fixture.h"

namespace cordillera::raster_test {

class WithGeoid : public RasterTest {
 protected:
  /// Regional geoid grid: 3 x 3 points from 9 E, 44 N at half a degree, height 40 + lon + 2 lat.
  std::string write_geoid(const std::string& name, double west = 9) const {
    Spec grid;
    grid.columns = grid.rows = 5, grid.geotransform = {west - 0.25, 0.5, 0, 46.25, 0, -0.5};
    grid.value = [west](int c, int r) { return -60 + (west + 0.5 * c) + 2 * (46 - 0.5 * r); };
    return write(grid, name);
  }
};

}  // namespace cordillera::raster_test
