#pragma once
// Points of a text as a raster.
#include <optional>
#include <string>

#include "proto/result.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {

/// Writes the points of a file as a GeoTIFF, as GDAL reads them. Where the file has no point there is no data: GDAL's driver says
/// so of most files and has zeros there in others. name: what the user called it; scope: that this is done in.
std::optional<proto::Problem> write_point_grid(const std::string& path, const std::string& name, const std::string& to,
                                               const GdalScope& scope);

}  // namespace cordillera::raster
