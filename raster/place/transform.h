#pragma once
// PROJ's transformations from and to longitude and latitude. PROJ searches its tables for milliseconds each time, and the rasters
// of a mosaic ask for the same: what was found is kept, and each caller gets a copy that nobody has used. Thread-safe.
#include <ogr_spatialref.h>

#include <cstddef>
#include <memory>

namespace cordillera::raster {

/// In degrees, longitude first.
OGRSpatialReference wgs84();

/// Whether operations may pass over the difference of two datums.
enum class Ballpark : bool { refused, allowed };

/// There, by the operations that PROJ has for all places; null: it has none.
std::unique_ptr<OGRCoordinateTransformation> to_wgs84(const OGRSpatialReference& from, Ballpark ballpark);

/// From there, by the operation that is best around a place, to a quarter of a degree; null: PROJ has none.
std::unique_ptr<OGRCoordinateTransformation> best_around(double longitude_deg, double latitude_deg, const OGRSpatialReference& to,
                                                         Ballpark ballpark);

/// In place, each point on its own; both coordinates are NaN where it has no image.
void apply(OGRCoordinateTransformation& transform, double* x, double* y, std::size_t count);

}  // namespace cordillera::raster
