#pragma once
// What tells whether rasters were cut from one grid.

namespace cordillera::raster {

/// Where the pixels of a raster lie on its map.
struct PixelGrid {
  double x = 0, y = 0;  ///< the outer corner of the first pixel, in units of the CRS
  double step_x = 0,
         step_y = 0;  ///< from pixel to pixel; 0: it goes on with no other, as one that is rotated or closes around the earth
  double turn = 0;    ///< once around the earth; 0: the CRS has no such thing
};

}  // namespace cordillera::raster
