#pragma once
// Where a raster lies on the earth, without looking at a pixel.
#include "proto/lattice.h"
#include "raster/place/area.h"
#include "raster/place/placement.h"

namespace cordillera::raster {

/// A rectangle in pixel coordinates that data can lie in.
struct PixelExtent {
  double west = 0, north = 0, east = 0, south = 0;
};

/// The area (degrees) that contains the image of the extent; the whole circle where it holds a pole or closes. tight: as
/// measured, for people. safe: widened by what may lie between the points measured, for windows that must not cut anything off.
struct Footprint {
  Area tight, safe;
  bool full_circle = false;
};
Footprint footprint(const Placement& placement, const PixelExtent& extent);

/// Ground size in metres of the pixel (c, r), along its line and across.
struct GroundSize {
  double width_m = 0, height_m = 0;
};
GroundSize ground_size(const Placement& placement, double c, double r);

/// Pixels that a cell of a lattice spans along each axis of the raster: the median over it, so that one kernel serves all. 1
/// where that cannot be told.
struct CellSpan {
  double x_px = 1, y_px = 1;
};
CellSpan cell_span(const Placement& placement, int columns, int rows, const proto::Lattice& lattice);

}  // namespace cordillera::raster
