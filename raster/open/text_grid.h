#pragma once
// What stands in place of numbers in an Esri ASCII grid. GDAL reads a word as 0, and in a grid of whole numbers nan and inf, too.
#include <string>

#include "proto/result.h"

namespace cordillera::raster {

/// Whether the grid has nan or inf, as they are written by any C library. "raster-unreadable": it has a word that is no number,
/// and its line. The whole file is read, once for as long as it stays as it is. What is no local file has none.
proto::Result<bool> has_not_finite(const std::string& path, const std::string& name);

}  // namespace cordillera::raster
