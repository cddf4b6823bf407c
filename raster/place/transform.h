#pragma once
// PROJ's transformations from and to longitude and latitude.
#include <ogr_spatialref.h>

#include <cstddef>
#include <memory>

namespace cordillera::raster {

/// In degrees, longitude first.
OGRSpatialReference wgs84();

/// From there, by the operation that is best around a place; null: PROJ has none that the options allow.
std::unique_ptr<OGRCoordinateTransformation> best_around(double longitude_deg, double latitude_deg, const OGRSpatialReference& to,
                                                         OGRCoordinateTransformationOptions options);

/// In place, each point on its own; both coordinates are NaN where it has no image.
void apply(OGRCoordinateTransformation& transform, double* x, double* y, std::size_t count);

}  // namespace cordillera::raster
