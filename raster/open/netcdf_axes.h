#pragma once
// Whether a NetCDF variable lies where GDAL puts it: GDAL places a grid by a corner and a step, whatever its axes are.
#include "proto/result.h"
#include "raster/open/dataset.h"

namespace cordillera::raster {

/// Of what is no NetCDF file nothing is said. Problems: raster-not-georeferenced, for rows that are meridians, and for columns or
/// rows that are not evenly spaced.
proto::Result<void> check_netcdf_axes(const Dataset& dataset);

}  // namespace cordillera::raster
